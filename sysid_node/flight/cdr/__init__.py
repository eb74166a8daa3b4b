"""CDR: serialised ROS messages to numbers and back.

``layout`` works out where each number of a message type lies, ``decode`` reads thousands of messages at once,
``single`` one at a time in flight. ``template`` writes messages whose strings are known in advance. ``bag`` and the
nodes use these.
"""
