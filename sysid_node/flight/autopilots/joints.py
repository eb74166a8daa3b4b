"""Joint positions from an autopilot's outputs: a linear map for each joint, given by the builder of the aircraft."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sysid_node.errors import InputError
from sysid_node.suggestion import did_you_mean


@dataclass(frozen=True)
class Joint:
    """A joint moved by one output."""

    name: str
    output: str
    trim: float  # value of the output at which the joint is at zero
    scale: float  # rad per unit of the output; for a throttle, its range 0..1 per unit

    def position(self, value: float) -> float:
        """The position of the joint for a value of the output: rad, or 0..1."""
        return self.scale * (value - self.trim)


def joints_of(text: str, outputs: Sequence[str], example: str, key: str = "parameter joints") -> tuple[Joint, ...]:
    """The joints described by words ``name=output:trim:scale`` with spaces between.

    Raises InputError, which names the ``key`` that states them, where there is none, or one is malformed, given twice,
    or not of one of the ``outputs``.
    """
    words = text.split()
    if not words:
        raise InputError(f"{key} is empty: say which output moves which joint and how far, e.g. {example!r}")
    joints = tuple(_joint(word, outputs, example, key) for word in words)
    names = [joint.name for joint in joints]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{key}: {twice!r} is given twice; mixing belongs in the aircraft file")
    return joints


def require_known(text: str, known: Sequence[str], aircraft: str, key: str) -> None:
    """Raise InputError where ``text`` names a joint that the aircraft, whose joints are ``known``, has not.

    A throttle may be stated for an aircraft without engine.
    """
    for word in text.split():
        name = word.partition("=")[0]
        if name not in known and name != "throttle":
            listed = ", ".join(known)
            raise InputError(
                f"{key}: {word!r}: {aircraft} has no joint {name!r}{did_you_mean(name, known)}; it has {listed}"
            )


def _joint(word: str, outputs: Sequence[str], example: str, key: str) -> Joint:
    form = f"NAME=OUTPUT:TRIM:SCALE, e.g. {example.partition(' ')[0]!r}"
    name, _, rest = word.partition("=")
    output, *numbers = rest.split(":")
    try:
        trim, scale = (float(number) for number in numbers)
    except ValueError:
        trim = scale = math.nan
    if not name or not math.isfinite(trim) or not math.isfinite(scale) or scale == 0.0:
        raise InputError(f"{key}: {word!r} is not {form}")
    if output not in outputs:
        expected = f"{outputs[0]} to {outputs[-1]}" if outputs else "none, as none was logged"
        raise InputError(f"{key}: {word!r}: no output {output!r}; expected {expected}")
    return Joint(name, output, trim, scale)
