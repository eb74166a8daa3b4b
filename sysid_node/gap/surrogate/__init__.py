"""Surrogate: a model of somebody's simulator, identified from flights that were recorded in it.

``simulated_flights`` checks the flights and splits off the part that is held out. ``first_guess`` gives the aircraft
file room: its derivatives are first guesses here, and its sensors are as noisy as the simulated ones. ``stepwise``
estimates derivatives and effects, ``curvature`` the lookup tables for what these leave. ``estimated_aircraft`` writes
both as an aircraft with their own standard errors as tolerances, and ``quality`` measures on simulated flight held out
how far it stands off the simulator. ``identify`` runs all steps.
"""
