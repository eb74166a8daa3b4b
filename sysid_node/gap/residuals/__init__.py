"""Residuals: what a flight measured minus what the simulator's chain predicts, by window and frequency.

Forces and moments are predicted from the measured motion, air data and attitude from the inertial instruments
(``flight_path_reconstruction``), both as functions of all parameters of the chain (``residual_model``). The series
are cut into windows and transformed (``windowed_spectra``); the sensors' noise and the air's motion give their
weights (``build``, ``air_motion``). ``estimation`` minimises these residuals.
"""
