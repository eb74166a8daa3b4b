"""What the methods that integrate a model share.

``rollout`` integrates a model and gives the exact Jacobian of its outputs; ``steady_kalman_filter`` predicts them one
step ahead. ``unknowns`` puts parameters, initial states and biases into one vector, a ``problem`` gives residuals and
their sensitivities (``filter_error_problem`` is filter error's), ``maximum_likelihood`` alternates between the noise
covariance and the unknowns, and ``covariance`` makes a fit of a finished search. ``joint_kalman_filter`` runs a Kalman
filter of state and parameters along manoeuvres.
"""
