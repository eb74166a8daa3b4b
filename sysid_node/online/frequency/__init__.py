"""From samples to the frequency domain.

``regression_signals`` forms aerodynamic coefficients and their regressors from a sample. ``fourier_transform`` is the
recursive finite Fourier transform of these signals. ``regression`` takes the transform's lines.
"""
