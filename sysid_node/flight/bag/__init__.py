"""rosbag2 recordings, read and written without ROS.

``raw_messages`` takes the serialised messages from rosbags' reader, ``reader`` decodes them into streams, ``writer``
writes streams. ``message_types`` knows the definitions of the messages. Above it, ``logs`` loads a flight of any kind.

rosbags gives a bag's raw messages through its public reader alone. A reader of MCAP chunks of our own, which used inner
classes of rosbags, read 240,000 messages in 0.36 of the time (0.65 s, not 1.8 s; rosbags' deserialisation takes 8.6 s)
and was dropped: to identify from these messages takes several times as long as the difference.
"""
