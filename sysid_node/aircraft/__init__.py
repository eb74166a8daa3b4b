"""Layer ``aircraft``: geometry, mass, derivatives, control mapping; no I/O except ``load``."""
