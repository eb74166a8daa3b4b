"""Layer ``gap``: where the simulator and the flight differ, which effect causes it, and how far the gap shrinks.

    result = diagnose(aircraft, flights, holdouts)    # all steps; document(result) is the content of gap.json

The argument, in order, a sub-package each:

1. ``flightdata``: a flight is low-passed and resampled, so that what was measured and commanded has one time base.
2. ``residuals``: forces and moments are predicted from the measured motion by the simulator's own chain of effects, air
   data and attitude from the inertial instruments. Turbulence is then an input and no error, and nothing drifts.
   Measured minus predicted is compared in short windows, by frequency.
3. ``estimation``: every effect of the chain is a candidate. Its parameters are estimated by least squares; errors of
   the derivatives within their tolerances, biases and clocks are nuisance parameters with limits. A fit is scored by
   how well it predicts windows and flights that it has not seen.
4. ``instruments``: gusts are in all flights and bias least squares. What the pilot's commands predict of the residual
   owes nothing to them: it gives sizes without that bias, a Bayes factor, and a test of whether structure is left.
5. ``selection``: candidates are added one at a time, replaced by better alternatives, and dropped where they are
   improbable or their equation is misspecified. The probabilities are calibrated on causes of known truth.
6. ``validation``: the simulator is flown with the causes on flight that was not fitted. Its errors before and after,
   beside those that noise alone would leave, say how far the gap shrinks, and which explanation stands.
7. ``verdict``: the scores of these steps decide on one of five words. Where the gap lies and what to fly next are
   added.

``thresholds`` holds every number that decides. What decides (``selection.acceptance``, ``replacement``, ``retention``,
``calibration``; ``validation.standing``; ``verdict.decision``) is pure: a function of a table of scores and of the
thresholds. The other modules fit, measure and fill these tables. ``diagnose`` runs all steps.
"""

from sysid_node.sim.compiled import xla

xla.configure()
