"""Alignment: messages of three topics become samples on the IMU's time base.

``streaming`` aligns message by message as they arrive; ``in_pieces`` does the same for a recording, piece by piece.
``flow_angle_filter`` estimates angle of attack and sideslip where no vane measures them (``flow_angle_model``,
``_equations`` and ``_errors`` hold its parts), and ``schedule`` says when estimates fall due. The samples go to
``frequency``.
"""
