"""Time series and scalar functions that the stations need.

``dryden`` makes turbulence, ``atmosphere`` air density, ``time_shift`` delays, and ``smooth`` differentiable limits.
"""
