"""Simulated flights.

``trim`` finds a steady state, ``rollout`` integrates a whole flight, ``live`` one sample at a time, with
``autopilot`` in the loop. ``sortie`` puts trim, weather, autopilot and noise together, and ``recording`` makes
messages of it. The commands and the node ``flight_simulator`` call these.
"""
