"""Layer ``control``: a flight controller that adapts its gains to the derivatives identified in flight.

``controller`` is the interface. ``design`` makes the gains of each axis for a linear model and finds their margins, and
``adaptation`` uses new estimates where the margins are kept within their confidence region. ``inputs`` checks what
arrives; ``law`` turns set-points into commands and joint positions. NumPy and SciPy only.
"""
