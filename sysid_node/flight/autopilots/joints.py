"""Joint positions from an autopilot's outputs: a linear map for each joint, given by the builder of the aircraft."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sysid_node.errors import InputError


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


def joints_of(text: str, outputs: Sequence[str], example: str) -> tuple[Joint, ...]:
    """The joints described by words ``name=output:trim:scale`` with spaces between.

    Raises InputError where there is none, or one is malformed, given twice, or not of one of the ``outputs``.
    """
    words = text.split()
    if not words:
        raise InputError(f"parameter joints is empty: say which output moves which joint and how far, e.g. {example!r}")
    joints = tuple(_joint(word, outputs, example) for word in words)
    names = [joint.name for joint in joints]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"parameter joints: {twice!r} is given twice; mixing belongs in the aircraft file")
    return joints


def _joint(word: str, outputs: Sequence[str], example: str) -> Joint:
    form = f"NAME=OUTPUT:TRIM:SCALE, e.g. {example.partition(' ')[0]!r}"
    name, _, rest = word.partition("=")
    output, *numbers = rest.split(":")
    try:
        trim, scale = (float(number) for number in numbers)
    except ValueError:
        trim = scale = math.nan
    if not name or not math.isfinite(trim) or not math.isfinite(scale) or scale == 0.0:
        raise InputError(f"parameter joints: {word!r} is not {form}")
    if output not in outputs:
        raise InputError(f"parameter joints: {word!r}: no output {output!r}; expected {outputs[0]} to {outputs[-1]}")
    return Joint(name, output, trim, scale)
