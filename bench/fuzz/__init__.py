"""Damaged input for every reader and command, for as long as one likes."""
