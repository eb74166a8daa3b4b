"""Residuals: what a flight measured minus what the simulator's chain predicts, by window and frequency.

Forces and moments are predicted from the measured motion, air data and attitude from the inertial instruments
(``flight_path_reconstruction``), by compiled functions of all parameters of the chain (``predictions``). A
``residual_model`` cuts measured and predicted series into windows and transforms them (``windowed_spectra``); ``build``
makes it from a flight, with the power of the sensors' noise and the motion of the air. ``estimation`` minimises the
residuals.
"""
