"""What the maximum-likelihood methods share.

``rollout`` integrates a model with its exact Jacobian, ``kalman`` is the steady Kalman filter, and ``unknowns`` puts
parameters, initial states and biases into one vector. ``maximum_likelihood`` alternates between the noise covariance
and the unknowns; ``covariance`` turns a converged search into a fit. ``methods.output_error`` and
``methods.filter_error`` call these.
"""
