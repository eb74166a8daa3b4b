"""Outputs of commands, files and folders: made aside, and moved into their place when they are whole."""
