"""Layer ``online``: recursive Fourier transform and sequential least squares. NumPy and SciPy only."""
