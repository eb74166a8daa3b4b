"""Validation: how far the gap shrinks on flight that was not fitted, and which explanation stands there.

The simulator's error is measured by frequency (``spectral_error``) and on short simulated flights
(``simulation_error``), beside what noise alone would leave (``noise_floor``). ``holdout`` does
so on flights held out, or on parts of the same flights (``kfold``), and keeps what stands by the rules of ``standing``.
``verdict`` draws the conclusion; ``standard_errors`` says how well the sizes are known.
"""
