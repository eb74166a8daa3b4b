"""rosbag2 recordings, read and written without ROS.

``reader`` turns a bag into streams of messages, ``raw_messages`` gives their bytes, ``writer`` writes streams and
estimates. ``message_types`` knows the message definitions. Above it, ``logs`` loads a flight from any file.
"""
