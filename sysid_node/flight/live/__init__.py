"""Messages as they come in flight, without ROS.

``messages`` gives the numbers of the input topics from serialised messages. ``arrivals`` detects messages that are
lost, late or out of order, and topics that are silent. ``monitor`` counts messages and measures durations.
``mean_force``, ``mean_lift``, ``deflections`` and ``unchanging`` say which values are those of no flight.
"""
