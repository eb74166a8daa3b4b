"""How JAX compiles the simulator.

``xla`` sets float64 and the compiler's options, and ``programs`` keeps traced programs on disk, so that a later process
need not trace them again. Both use the user's cache folder.
"""
