"""Commands of the controls from ArduPilot's servo outputs, by ``SERVOn_FUNCTION``, ``_MIN``, ``_MAX``, ``_TRIM`` and
``_REVERSED``, of elevons and V-tails by ``MIXING_GAIN`` and ``MIXING_OFFSET``, too."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sysid_node.flight.logs.autopilot_log import LoggedCommands, Signal, absent
from sysid_node.flight.logs.readers.mixing import SIGNS, at_full_stick, unmixed
from sysid_node.flight.record import Array

#: Kinds of surfaces by SERVOn_FUNCTION (ArduPilot, ``SRV_Channel.h``). A flaperon moves as a single aileron command.
_KINDS = {
    4: "aileron",
    19: "elevator",
    21: "rudder",
    24: "aileron",
    25: "aileron",
    77: "left elevon",
    78: "right elevon",
    79: "left V-tail",
    80: "right V-tail",
}
_MIXED = (77, 78, 79, 80)
_FLAPS = (2, 3)
_THROTTLES = (70, 73, 74)

#: Pulses (us) outside this range are no positions: 0 and 65535 mean that an output is not used.
_SHORTEST, _LONGEST = 400.0, 2600.0


def control_commands(
    outputs: LoggedCommands, parameters: Mapping[str, float]
) -> tuple[LoggedCommands, tuple[str, ...]]:
    """The controls' fractions of full command, and remarks, from the pulses (us) of the outputs out1, out2, ..."""
    pulses = np.where((outputs.signal.values >= _SHORTEST) & (outputs.signal.values <= _LONGEST), 1.0, np.nan)
    pulses = pulses * outputs.signal.values
    functions = {i: int(parameters.get(f"SERVO{i + 1}_FUNCTION", 0)) for i in range(len(outputs.names))}
    surfaces = [i for i, function in functions.items() if function in _KINDS and np.isfinite(pulses[:, i]).any()]
    if not surfaces:
        return LoggedCommands((), absent(outputs.signal.source, 0)), _without_surfaces(parameters)
    commands = np.column_stack([_angle(pulses[:, i], i + 1, parameters) for i in surfaces])
    full = at_full_stick(np.array([_gains(functions[i], parameters) for i in surfaces]))
    names, fractions = unmixed(full, commands)
    columns = [fractions]
    reverse = parameters.get("THR_MIN", 0.0) < 0.0  # ArduPlane then scales the throttle from the trim to either side
    for name, wanted in (("flap", _FLAPS), ("throttle", _THROTTLES)):
        places = [i for i, function in functions.items() if function in wanted and np.isfinite(pulses[:, i]).any()]
        if places:
            names = (*names, name)
            scaled = _angle if name == "throttle" and reverse else _range
            columns.append(np.mean([scaled(pulses[:, i], i + 1, parameters) for i in places], axis=0)[:, np.newaxis])
    signal = Signal(outputs.signal.source, outputs.signal.stamp_ns, np.hstack(columns))
    still = ("MIXING_GAIN is 0: elevons and V-tails do not move",) if not full.any(axis=1).all() else ()
    return LoggedCommands(names, signal), still


def _gains(function: int, parameters: Mapping[str, float]) -> tuple[float, float, float]:
    """A surface's command, as a fraction of its travel, for each unit of roll, pitch and yaw.

    Elevons are (elevator -+ aileron) MIXING_GAIN and V-tails (elevator +- rudder) MIXING_GAIN. A MIXING_OFFSET (%)
    above zero enlarges the aileron or the rudder before that, one below zero the elevator (ArduPlane ``servos.cpp``,
    ``channel_function_mixer``; the defaults are those of ``Parameters.cpp``).
    """
    roll, pitch, yaw = map(float, SIGNS[_KINDS[function]])
    if function not in _MIXED:
        return roll, pitch, yaw
    gain, offset = parameters.get("MIXING_GAIN", 0.5), parameters.get("MIXING_OFFSET", 0.0) / 100.0
    of_elevator, of_other = gain * (1.0 + max(-offset, 0.0)), gain * (1.0 + max(offset, 0.0))
    return roll * of_other, pitch * of_elevator, yaw * of_other


def _without_surfaces(parameters: Mapping[str, float]) -> tuple[str, ...]:
    if any(name.startswith("SERVO") and name.endswith("_FUNCTION") for name in parameters):
        return ("no SERVOn_FUNCTION is an aileron, elevator, rudder, elevon or V-tail",)
    return ("the log holds no parameters SERVOn_FUNCTION",)


def _limits(output: int, parameters: Mapping[str, float]) -> tuple[float, float, float, float]:
    """Shortest and longest pulse and trim (us), and the sign, of an output."""
    low, high, trim, turned = (
        parameters.get(f"SERVO{output}_{key}", value)
        for key, value in (("MIN", 1100.0), ("MAX", 1900.0), ("TRIM", 1500.0), ("REVERSED", 0.0))
    )
    return low, high, trim, -1.0 if turned else 1.0


def _angle(pulses: Array, output: int, parameters: Mapping[str, float]) -> Array:
    """Fractions -1..1 of the travel from the trim to either end."""
    low, high, trim, sign = _limits(output, parameters)
    travel = np.where(pulses >= trim, max(high - trim, 1.0), max(trim - low, 1.0))
    fraction: Array = sign * (pulses - trim) / travel
    return np.clip(fraction, -1.0, 1.0)


def _range(pulses: Array, output: int, parameters: Mapping[str, float]) -> Array:
    """Fractions 0..1 of the travel from one end to the other."""
    low, high, _, sign = _limits(output, parameters)
    fraction = (pulses - low) / max(high - low, 1.0)
    return np.clip(fraction if sign > 0 else 1.0 - fraction, 0.0, 1.0)
