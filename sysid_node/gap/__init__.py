"""Layer ``gap``: where the simulator and the flight differ, which effect causes it, how far the gap shrinks.

    views = [view_of(simulator, flight) for flight in flights]     # measured coefficients in windows, by frequency
    result = diagnose(aircraft, flights, holdout)                  # all of it, as gap.json has it

Forces and moments are predicted from the measured motion by the simulator's own chain (``sim.prediction``), so that
turbulence is an input and drift does no harm; comparison is by frequency, in short windows (``spectra``). Errors of the
derivatives within their tolerances and biases are nuisances (``nuisance``), integrated out. Every
effect is a candidate (``candidates``), fitted by variable projection (``fit``) and judged by how well it predicts
flight that it was not fitted to (``evidence``).
"""

from sysid_node.sim import xla

xla.configure()
