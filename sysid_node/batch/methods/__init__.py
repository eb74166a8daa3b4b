"""The batch estimators, one file each, and what puts them on whole flights.

Regressions (``equation_error`` and others) solve for coefficients that were measured; ``output_error`` and
``filter_error`` integrate a model (``integrated_models``); ``kalman_filters`` estimate states and parameters
together. ``stepwise`` chooses regressors. Every method returns a ``results.result.Fit``.
"""
