"""How JAX compiles the simulator.

``xla`` sets float64 and the compiler's options, and ``programs`` keeps traced programs on disk.
"""
