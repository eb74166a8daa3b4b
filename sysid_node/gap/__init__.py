"""Layer ``gap``: where the simulator and the flight differ, which effect causes it, how far the gap shrinks.

    views = [view_of(simulator, flight) for flight in flights]     # measured coefficients in windows, by frequency
    result = diagnose(aircraft, flights, holdouts)                 # all of it; document(result) is gap.json

Forces and moments are predicted from the measured motion by the simulator's own chain (``sim.prediction``), air data
and attitude from the inertial instruments (``kinematics``), so that turbulence is an input and drift does no harm;
comparison is by frequency, in short windows (``spectra``, ``view``). Errors of the derivatives within their tolerances,
biases and clocks are nuisances (``nuisance``). Every effect is a candidate (``candidates``), fitted by variable
projection (``fit``) and judged by how well it predicts flight that it was not fitted to (``evidence``, ``attribute``,
``holdout``); what is left over is tested for structure (``structure``). ``verdict`` says it in a word, ``localise``
where, ``next_flight`` what to fly.
"""

from sysid_node.sim.compiled import xla

xla.configure()
