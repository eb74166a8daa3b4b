"""Gazebo's models (SDF), read by the published equations of gz-sim's plugins.

``sdf`` reads links, joints, poses and masses; ``lift_drag`` and ``advanced_lift_drag`` are the plugins' loads;
``controls`` finds which joints are elevator, aileron and rudder; ``read`` puts the aircraft together.
"""
