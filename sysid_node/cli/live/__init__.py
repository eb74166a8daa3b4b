"""Commands that run ROS nodes, ``demo`` and ``loop``, and the programs ``view`` and ``markers``, which show a flight.

They share processes, a ROS domain of their own, and the live table.
"""
