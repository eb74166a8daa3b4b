"""Estimation: the parameters of a set of candidate effects by least squares, nuisance parameters eliminated.

``nuisances`` lists what is always allowed for, ``candidates`` the effects that may be to blame, and ``fit`` estimates
both by variable projection. ``predictive_density`` says how well a fit predicts windows and flights that it has not
seen, ``checkpoint`` keeps finished fits on disk. ``instruments`` and ``selection`` work on these fits.
"""
