"""Simulated flights.

``trim`` finds a steady state. ``rollout`` integrates a whole flight, with ``autopilot`` in the loop where it is asked
for; ``live`` integrates one sample at a time, at the ``pace`` of a real clock. ``sortie`` combines trim, turbulence,
autopilot and noise, and ``recording`` makes messages of it. The commands and the node ``flight_simulator`` call these.
"""
