"""Time series and scalar functions that the stations need.

``dryden`` makes turbulence, ``time_shift`` delays signals and differentiates them, and ``smooth`` has differentiable
limits, dead zones and steps.
"""
