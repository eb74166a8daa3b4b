"""Prior distribution and bounds of the simulator's parameters, as every least-squares step of the diagnosis uses them.

Both depend on the simulator alone. Where a diagnosis knows more than the effect's own definition does (a control
surface counts as stuck only if nearly all of its movement is gone; a stamp is never early), it narrows the bounds here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import EFFECTS, Simulator
from sysid_node.sim.effects.base import THROTTLE

#: Effects of message stamps. No message is stamped before the instant that it describes: if stamps could be early, then
#: late commands and late air data could pass for an early IMU, and the three clocks could not be told apart.
_STAMP_EFFECTS = frozenset({"air_data_delay", "imu_delay", "actuator_stamp_delay"})

_STRUCTURAL_FREQUENCY = ("structural_mode", "frequency")

#: Least abruptness of a stall: from 0.9 to 0.1 of the flow attached within 0.44 rad. What is slower is another slope.
_ABRUPTNESS, _LEAST_ABRUPT = ("stall_separation", "a1"), 5.0

#: Farthest that an instrument may be off its place, in spans: a nose boom is shorter than a fuselage.
_FARTHEST = {"vane_lever_arm": 1.5, "imu_lever_arm": 1.0}

#: Damping of a servo of second order. With more of it, it is two lags of first order, of which the slower one counts.
_SERVO_DAMPING = (0.3, 1.0)

#: Standard deviation of an onset's prior, s: it may lie at any time of the flight.
_ONSET_SIGMA = 100.0


def bounds(simulator: Simulator, indices: Sequence[int]) -> tuple[Array, Array]:
    """Lower and upper bounds (K,) of these entries of the parameter vector, in the parameters' own units."""
    table = [simulator.parameters[i] for i in indices]
    lower = [
        THRESHOLDS.priors.jammed if effect == "stuck_surface" and parameter.switch
        else THRESHOLDS.priors.lowest_mode if (effect, parameter.name) == _STRUCTURAL_FREQUENCY
        else _LEAST_ABRUPT if (effect, parameter.name) == _ABRUPTNESS
        else 0.0 if effect in _STAMP_EFFECTS
        else parameter.lower
        for effect, parameter in table
    ]  # fmt: skip
    upper = [parameter.upper for _, parameter in table]
    for place, (effect, _) in enumerate(table):
        if effect in _FARTHEST:  # of the file's place, in spans
            room = _FARTHEST[effect] * simulator.aircraft.geometry.b
            lower[place], upper[place] = max(lower[place], -room), min(upper[place], room)
        elif (effect, table[place][1].name) == ("actuator_lag", "damping") and not simulator.neutral()[indices[place]]:
            lower[place], upper[place] = _SERVO_DAMPING
    for place, (effect, parameter) in enumerate(table):
        shared = EFFECTS[effect].shared
        if shared and parameter.name in (*simulator.layout.controls, THROTTLE):  # the sum with the shared is bounded
            known = float(simulator.neutral()[simulator.names.index(f"{effect}.{shared}")])
            whole = next(p for e, p in simulator.parameters if (e, p.name) == (effect, shared))
            lower[place], upper[place] = whole.lower - known, whole.upper - known
    return np.array(lower), np.array(upper)


def prior(simulator: Simulator, indices: Sequence[int]) -> tuple[Array, Array]:
    """Mean and standard deviation (K,) of the Gaussian prior of these entries, in the parameters' own units.

    The mean is the aircraft file's value.
    """
    parameters = [simulator.parameters[i][1] for i in indices]
    sigma = [
        _ONSET_SIGMA if parameter.name == "onset" else THRESHOLDS.priors.scale * simulator.scales[i]
        for i, parameter in zip(indices, parameters, strict=True)
    ]
    return simulator.neutral()[list(indices)], np.array(sigma)
