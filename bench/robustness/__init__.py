"""Damaged input and signals at random times, for every reader and command."""
