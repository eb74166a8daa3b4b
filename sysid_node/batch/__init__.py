"""Layer ``batch``: estimators that see the whole flight at once.

Imported for its side effect as well: JAX in float64, with the compiler options and the cache of the simulator.
"""

from sysid_node.sim.compiled import xla

xla.configure()
