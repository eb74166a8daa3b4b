"""The simulator's chain on measured signals, without integrating the motion.

``signals`` puts a flight record on a regular time base, and ``true_motion`` removes the errors of the sensors from it.
``accelerations`` evaluates the chain's forces and moments at these samples and predicts the readings of the inertial
instruments; it takes the states of actuators, motor and flow separation from ``carried_states`` and the vibration from
``structural_response``, and ``active_effects`` leaves out what acts on nothing. ``coefficients`` reduces accelerations,
predicted or measured, to the six aerodynamic coefficients.
"""
