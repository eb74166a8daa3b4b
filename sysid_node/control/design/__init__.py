"""Gains of a control axis: the linear ``plant``, the ``regulator`` designed with it, and the ``margins`` of the loops.

``axis`` puts them together, for the aircraft file's derivatives and for any others. ``confidence_region`` says for
which derivatives margins must be kept.
"""
