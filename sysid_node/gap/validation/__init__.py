"""Validation: how far the gap shrinks on flight that was not fitted.

The simulator's error is measured in the frequency domain (``spectral_error``) and in the time domain on short
simulated flights (``simulation_error``, ``multiple_shooting``), beside what noise alone would leave
(``noise_floor``). Flights held out are the check (``holdout``), or parts of the same flights (``kfold``). ``verdict``
draws the conclusion from these numbers.
"""
