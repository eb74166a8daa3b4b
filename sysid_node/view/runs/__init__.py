"""Scenes of what the commands write: each module reads one kind of folder or file; ``opening`` tells them apart."""
