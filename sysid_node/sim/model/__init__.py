"""The simulator's equations as pure functions.

``parameters`` holds the parameters of all effects as one vector, ``layout`` holds the names that shape the compiled
program and the aircraft's numbers, and ``state`` names the entries of the state vector. ``chain`` evaluates all
stations at one instant; ``flying`` integrates it, and ``prediction`` evaluates it on measured signals.
"""
