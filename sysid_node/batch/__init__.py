"""Estimators that use whole flights, after the flight.

``identify`` is the entry: it corrects the sensors' errors on request (``data_compatibility``), runs one of the
``methods`` on the flights, and checks the estimates on flights held out. A method either regresses aerodynamic
coefficients that were formed from measurements (``regression``), or integrates a state-space model (``models``) and
maximises its ``likelihood``; all return the classes of ``results``. ``settings`` are those of ``--set``.

Importing this package configures JAX: float64, with the simulator's compiler options and cache.
"""

from sysid_node.sim.compiled import xla

xla.configure()
