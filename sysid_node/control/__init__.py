"""Layer ``control``: a flight controller that adapts its gains to the derivatives identified in flight.

``controller`` is the interface. For each ``axis`` it designs gains with a linear ``plant`` and a ``regulator``, and
lets ``adaptation`` use new estimates where the ``margins`` are kept at the corners of their intervals. ``law`` turns
set-points into commands along a ``reference`` motion; ``allocation`` gives the joint positions. NumPy and SciPy only.
"""
