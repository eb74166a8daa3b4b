"""What a fleet of flights tells, checked on fleets whose truth is sealed."""
