"""Systematic errors of the batch methods: what the tolerances of aircraft and instruments do to their estimates.

``flight_posterior`` asks the online estimator what the flights tell of every imperfection (servos, clocks, scales,
places, mass). ``stated_errors`` takes errors of instruments and stamps that the file states out of the flights before
that. ``clocks`` takes the estimated lateness of servos and instruments out of the flights, before any method sees
them. ``sensitivities`` says how far a method's estimates move with what is left unknown, and ``systematic_errors``
adds this to the estimates' intervals, with the servos and the error budget. ``dead_sensors`` withholds what depends on
a reading that stood still.
"""
