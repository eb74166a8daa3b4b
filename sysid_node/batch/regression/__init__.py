"""What the regression methods share.

``equations`` forms coefficients and regressors of a flight, ``filtering`` differentiates and low-passes signals, and
``linear_regression`` solves with standard errors for coloured residuals (``coloured_residuals``).
``errors_in_variables`` corrects for noisy regressors, ``jackknife`` and ``effective_length`` say how much data there
really is. The files in ``methods`` call these.
"""
