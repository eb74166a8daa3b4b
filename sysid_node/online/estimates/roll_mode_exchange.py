"""Whether the roll mode and the aileron's servo may have exchanged their time constants.

A roll follows the aileron's command through two lags, the servo's and the roll mode's, and lags may be exchanged. Let
the servo's time constant come out as L and that of the roll mode as T. A servo of T on an aircraft that rolls with L,
and whose derivatives are T / L times as large, answers the controls in nearly the same way. Only the form of the
servo's response, and the motion without the aileron, tell the two apart. The search for another solution
(``renewal.servo_search``) does not always find it: in what has been summed up of the flight, the ends of the segments
hold for a servo that is about as late as it was taken to be then.

So the two are weighed by the aircraft file: by its derivatives of the rolling moment, whose errors have Student's
distribution as in the search, and by what is believed of the servo. The slopes of the rolling moment count as
exchanged where the other solution is clearly the more probable one. A file that is far from the truth may make right
slopes suspicious, too: they are withheld until the servo is known from the bench, or the file is corrected.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression import mixed_estimation
from sysid_node.online.regression.damping import DAMPING
from sysid_node.online.regression.information import Information
from sysid_node.online.renewal.servo_search import APART
from sysid_node.online.state import EstimatorState, SegmentSolution
from sysid_node.online.systematic.imperfections import Imperfections

Array = NDArray[np.float64]

MOMENT = "Cl"
RATE, CONTROL = DAMPING[MOMENT]
CLEARLY = 6.0  # difference of -2 log p: odds of 20 to 1
PROMPT = 0.01  # s: a servo that is less late than this has no time that the roll mode could have


def exchanged(state: EstimatorState, latest: SegmentSolution) -> bool:
    """Whether the aircraft file speaks for the solution with exchanged time constants."""
    imperfect, found, structure = state.model.imperfections, latest.systematic, state.equations.structure
    if imperfect is None or found is None or MOMENT not in structure.coefficients:
        return False
    c, servo = structure.coefficients.index(MOMENT), _place_of_servo(state, imperfect)
    own = {structure.regressors[i]: i for i in structure.unknowns(c).tolist()}
    if servo is None or RATE not in own:
        return False
    theta, variance = (each[:, c] for each in latest.corrected(found))
    at = imperfect.timed[servo]
    late = float(found.servos.lateness[at])
    mode = roll_time_constant(state.model.aircraft, float(theta[own[RATE]]), _mean_pressure(latest.total))
    if late < PROMPT or not math.isfinite(mode) or abs(mode - late) < APART * float(found.errors[servo]):
        return False
    expected = float(imperfect.applied.lateness[at] + imperfect.expected[servo])
    believed, precision = (each[:, c] for each in state.model.prior)
    told = np.where(structure.belongs[:, c] > 0.0, precision, 0.0)

    def improbability(factor: float, lateness: float) -> float:
        of_servo = ((lateness - expected) / float(imperfect.sigmas[servo])) ** 2
        return of_servo + mixed_estimation.improbability(factor * theta - believed, told, factor**2 * variance)

    return improbability(1.0, late) > improbability(mode / late, mode) + CLEARLY


def _place_of_servo(state: EstimatorState, imperfect: Imperfections) -> int | None:
    """The place of the aileron among the controls that are not exactly known; None where it is not among them."""
    timed = [state.model.layout.timed[place] for place in imperfect.timed.tolist()]
    return timed.index(CONTROL) if CONTROL in timed else None


def _mean_pressure(total: Information) -> float:
    """The flight's mean dynamic pressure over its reference value."""
    return float(total.integrals[OFFSET]) / total.energy


def roll_time_constant(aircraft: Aircraft, damping: float, pressure: float = 1.0) -> float:
    """Time constant (s) of the roll mode by ``Cl_p``; infinite where it is not damped.

    ``pressure`` is the dynamic pressure over its reference value; the density is the reference's.
    T = 2 V Ixx / (q S b^2 |Cl_p|) (Etkin & Reid, "Dynamics of Flight", 3rd ed. (1996), sec. 6.7).
    """
    if not damping < 0.0:
        return math.inf
    reference, geometry = aircraft.reference, aircraft.geometry
    airspeed = reference.airspeed * math.sqrt(pressure)
    force = 0.5 * reference.air_density * airspeed**2 * geometry.S
    return 2.0 * airspeed * aircraft.inertia.Ixx / (force * geometry.b**2 * -damping)
