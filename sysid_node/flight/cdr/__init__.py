"""Serialised ROS messages (CDR) to numbers and back, without ROS and without an object for each part of a message.

``layout`` finds where the numbers of a message lie. ``decoding`` reads all messages of a recording at once as columns,
``message_reader`` reads single messages in flight; both apply a layout. ``template`` writes messages, one or thousands,
in flight and into bags.

Measured by ``bench/speed/read.py`` (240,000 messages, one core): to decode a bag as columns takes a fifth of the time
of rosbags' own deserialisation message by message, and half of that of ``message_reader`` message by message. In flight
``message_reader`` reads an IMU message in 0.02 of the time of rclpy's deserialisation, and a template writes a message
of estimates in 0.2 to 0.4 of the time of rclpy's objects and serialisation.
"""
