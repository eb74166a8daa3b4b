"""What estimation, replay, reading and diagnosis cost in time and memory."""
