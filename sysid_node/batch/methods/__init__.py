"""The batch estimators, one file each; every method returns a ``results.batch_fit.BatchFit``.

Six methods regress measured coefficients: ``equation_error``, ``frequency_equation_error``,
``recursive_least_squares``, ``error_filtering``, ``constrained_least_squares`` and ``neural_gauss_newton``.
``output_error`` and ``filter_error`` maximise the likelihood of a model; ``maximum_likelihood_estimation`` chooses the
model for given flights, cuts them into pieces and finds start values. The extended, iterated and unscented Kalman
filters estimate state and parameters together; ``joint_estimation`` sets them up for given flights.
"""
