"""Layer ``flight``: recorded and live flights as time-aligned columns.

A reader (``bag``, ``csv``, ``autopilots``, chosen by ``logs``) gives ``streams``, the messages of each input topic as
arrays. ``align`` rejects implausible messages (``checks``), converts joints to controls (``actuation``) and
interpolates the topics to one time base: a ``record``. ``live`` and ``cdr`` do the same for single messages in flight.
"""
