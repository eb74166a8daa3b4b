"""The aircraft as a model for other simulators.

There is one module for each format (``jsbsim``, ``gazebo``, ``rosflight``); each turns an ``Aircraft`` and the effects
that the format can express into text. ``polar`` gives them the drag as a parabola of lift.
"""
