"""Estimation: the parameters of a set of candidate effects by least squares, nuisance parameters eliminated.

``nuisances`` lists what may always be off, ``candidates`` the effects that may be to blame. A ``candidate_fit`` holds
both for one or more flights; ``variable_projection`` and ``convergence`` move it to its maximum a posteriori.
``predictive_density`` says how well a fit predicts windows and flights that it has not seen, and ``checkpoint`` keeps
finished fits on disk. ``instruments`` and ``selection`` work on these fits.
"""
