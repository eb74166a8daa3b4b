"""Online estimation: recursive Fourier transform and sequential least squares. NumPy and SciPy only.

``alignment`` turns the messages of three topics into samples on the IMU's time base. ``frequency`` makes signals of
them (force and moment coefficients and their regressors) and transforms these recursively. With every half second of
data ``renewal`` measures and solves anew (by ``regression``, with the errors of what is taken as known by
``systematic``), and tests for ``changes`` of the aircraft. ``estimates`` solves with all samples so far whenever the
schedule says so, and decides what is valid.
``estimator`` holds ``init`` and ``update``; the live node and ``replay`` call both, and then ``estimate``.
"""
