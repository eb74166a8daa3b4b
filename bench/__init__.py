"""Programs that measure. README.md lists them; `python -m bench.ROOM.NAME` runs one from the repository's root."""
