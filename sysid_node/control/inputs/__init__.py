"""What arrives at the controller: published ``estimates`` and set-points, and the checks of all numbers."""
