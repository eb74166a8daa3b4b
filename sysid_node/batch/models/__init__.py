"""Models for the methods that integrate the equations of motion.

``model`` defines a state-space model with its parameters, ``manoeuvre`` the data that it is fitted to. ``rigid_body``
(with ``aerodynamics``, ``kinematics`` and ``gusts``), ``short_period`` and ``lateral_rates`` are such models.
``model_for_flights`` chooses the rigid-body model that the measurements allow, and ``manoeuvres`` turns flight records
into its data.
"""
