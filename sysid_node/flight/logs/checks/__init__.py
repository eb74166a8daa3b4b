"""What a flight's file is good for, before anything is identified from it.

``refusals`` are the reasons for which a flight is not taken: ``opening`` raises them, and the ``survey`` tells them
beforehand. ``excitation`` measures how surely a flight shows what its controls do.
"""
