"""The aircraft as a model of Gazebo.

``fit`` finds the numbers of the plugin AdvancedLiftDrag, ``parts`` writes masses, servos and rotor, ``model`` all.
"""
