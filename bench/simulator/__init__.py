"""The simulator: its speed, and imported models beside their own programs."""
