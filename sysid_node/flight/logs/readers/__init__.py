"""Readers of autopilots' logs and of recordings of their topics.

``ulog`` (PX4), ``dataflash`` and ``telemetry`` (ArduPilot, MAVLink) and ``autopilot_bag`` (ROS) give an
``AutopilotLog``. ``px4_controls`` and ``ardupilot_controls`` turn outputs into commands of the axes by the log's own
parameters, with the ``mixing`` of surfaces undone. ``packages`` loads the libraries that only logs need.
"""
