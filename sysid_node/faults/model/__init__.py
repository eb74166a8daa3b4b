"""The reference model of the fault monitor: what the aircraft should do if nothing has failed.

``blocks`` averages samples to tenths of a second, ``terms`` lists the model's regressors, and ``reference_model``
holds the last good derivatives. ``residual_whitening`` learns the autocorrelation of the residuals,
``gust_correlation`` what gusts may have taught. ``hypotheses`` explains what the model leaves.
"""
