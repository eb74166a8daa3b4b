"""The aircraft as a model for other simulators.

There is one module or package for each format (``jsbsim``, ``gazebo``, ``rosflight``); each turns an ``Aircraft`` and
effects into text, and says what the format does not hold. ``folding`` takes effects that are merely other numbers into
the aircraft, ``steady`` has the coefficients that formats of derivatives are to give, and ``losses`` compares.
"""
