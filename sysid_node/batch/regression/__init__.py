"""What the regression methods share.

``measured_coefficients`` forms both sides of the equations from a flight's signals (``filtering``), ``regressors``
chooses the columns, and ``linear_regression`` solves them: with a correction for noisy regressors
(``errors_in_variables``), and with standard errors for coloured residuals (``coloured_residuals``, ``jackknife``,
``effective_length``). ``stepwise`` selects regressors, ``sequential`` estimates in one pass along the flights, and
``combined_fit`` makes one fit of the regressions of all coefficients.
"""
