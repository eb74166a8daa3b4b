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
from sysid_node.online.regression.damping import DAMPING
from sysid_node.online.renewal.servo_search import APART, FREEDOM
from sysid_node.online.state import EstimatorState, SegmentSolution

Array = NDArray[np.float64]

MOMENT = "Cl"
RATE, CONTROL = DAMPING[MOMENT]
CLEARLY = 6.0  # difference of -2 log p: odds of 20 to 1
PROMPT = 0.01  # s: a servo that is less late than this has no time that the roll mode could have


def exchanged(state: EstimatorState, latest: SegmentSolution) -> bool:
    """Whether the aircraft file speaks for the solution with exchanged time constants."""
    imperfect, found, structure = state.model.imperfections, latest.systematic, state.equations.structure
    timed = [] if imperfect is None else [state.model.layout.timed[place] for place in imperfect.timed.tolist()]
    if imperfect is None or found is None or MOMENT not in structure.coefficients or CONTROL not in timed:
        return False
    c, servo = structure.coefficients.index(MOMENT), timed.index(CONTROL)
    own = {structure.regressors[i]: i for i in structure.unknowns(c).tolist()}
    late = float(found.servos.lateness[imperfect.timed[servo]])
    if RATE not in own or late < PROMPT:
        return False
    theta, variance = (each[:, c] for each in latest.corrected(found))
    mode = roll_time_constant(state.model.aircraft, float(theta[own[RATE]]))
    if not math.isfinite(mode) or abs(mode - late) < APART * float(found.errors[servo]):
        return False
    expected = float(imperfect.applied.lateness[imperfect.timed[servo]] + imperfect.expected[servo])
    sigma, times = float(imperfect.sigmas[servo]), mode / late
    believed, precision = (each[:, c] for each in state.model.prior)
    told = (precision > 0.0) & (structure.belongs[:, c] > 0.0)
    tolerance = precision[told] ** -0.5

    def improbability(factor: float, lateness: float) -> float:
        off = factor * theta[told] - believed[told]
        squares = off**2 / (tolerance**2 + factor**2 * np.maximum(variance[told], 0.0))
        of_servo = ((lateness - expected) / sigma) ** 2
        return of_servo + float((FREEDOM + 1.0) * np.log1p(squares / FREEDOM).sum())

    return improbability(1.0, late) > improbability(times, mode) + CLEARLY


def roll_time_constant(aircraft: Aircraft, damping: float) -> float:
    """Time constant (s) of the roll mode by ``Cl_p`` at the reference condition; infinite where it is not damped.

    T = 2 V Ixx / (q S b^2 |Cl_p|) (Etkin & Reid, "Dynamics of Flight", 3rd ed. (1996), sec. 6.7).
    """
    if not damping < 0.0:
        return math.inf
    reference, geometry = aircraft.reference, aircraft.geometry
    force = 0.5 * reference.air_density * reference.airspeed**2 * geometry.S
    return 2.0 * reference.airspeed * aircraft.inertia.Ixx / (force * geometry.b**2 * -damping)
