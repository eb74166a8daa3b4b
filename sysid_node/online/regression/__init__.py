"""Regression in the frequency domain: values of the derivatives and the corrections of their standard errors.

``information`` forms Gram matrices of the transformed signals, ``normal_equations`` says which of their entries belong
to which coefficient, and ``least_squares`` solves them; ``instruments`` and ``mixed_estimation`` add instrumental
variables and the aircraft file's values. The other modules correct standard errors: for noise in the regressors,
heteroskedastic noise, weak instruments, correlated gusts, bands that disagree, late actuators, and selection.
``changes`` and ``estimates`` use the solutions.
"""
