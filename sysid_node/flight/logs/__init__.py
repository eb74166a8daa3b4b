"""Whatever is a flight, opened by its content: bags, autopilots' logs and tables.

``content`` tells what a file is, and ``readers`` read an autopilot's as an ``autopilot_log``. ``log_streams`` takes the
part ``flown`` with its ``air_data`` and gives the streams of the flight, ``fractions`` turns commands into joints,
``rates`` says what is too slow, and ``opening`` does all of this for the commands.
"""
