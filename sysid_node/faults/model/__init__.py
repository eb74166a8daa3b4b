"""The reference model of the fault monitor: the forces and moments of the aircraft without a fault.

``blocks`` averages samples to tenths of a second, ``terms`` lists the model's regressors, and ``reference_model``
holds the derivatives from before a fault. ``residual_whitening`` estimates the autocorrelation of the residuals, and
``gust_correlation`` bounds the bias due to gusts. ``hypotheses`` explains the residuals.
"""
