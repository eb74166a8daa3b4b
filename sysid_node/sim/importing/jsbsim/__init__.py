"""JSBSim's models, read through JSBSim's own module.

``files`` finds and copies a model, ``program`` runs JSBSim on the copy and gives its forces in any state, ``surfaces``
finds which surfaces a pilot's command moves, ``trim`` the steady flight, ``actuators`` reads the servos out of the
flight control system, and ``read`` puts the aircraft together.
"""
