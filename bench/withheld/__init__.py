"""The check on withheld effects: plants that hand over bags and an aircraft file, and nothing else.

The plants are written apart from the simulator: plain floats, another integrator, other actuators, an autopilot with
its own instruments. They know an effect by its equation and share with the diagnosis only the file formats.
"""
