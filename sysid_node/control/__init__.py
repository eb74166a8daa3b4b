"""Layer ``control``: a flight controller that uses the derivatives identified in flight, NumPy and SciPy only."""
