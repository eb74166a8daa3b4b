"""Regression in the frequency domain: values of the derivatives and what they are worth.

``information`` forms Gram matrices of the transformed signals, ``least_squares`` solves them, ``instruments`` and
``mixed_estimation`` add instrumental variables and the aircraft file's beliefs. The other modules correct standard
errors: for noise in the regressors, heteroskedastic noise, weak instruments, correlated gusts, late actuators, and
selection. ``changes`` and ``estimates`` use the solutions.
"""
