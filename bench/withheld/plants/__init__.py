"""The plants of withheld effects, written apart from the simulator: plain floats, another integrator, other actuators.

They know an effect by its equation and share with the diagnosis only the file formats.
"""
