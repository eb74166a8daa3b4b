"""What a fleet's folder remembers: one SQLite file, so that a fleet that is started again does nothing twice.

``store`` keeps what came of each flight, each in a transaction of its own. ``fingerprints`` says what a flight's result
depends on: the content of its log and aircraft file, the settings, and the program's version.
"""
