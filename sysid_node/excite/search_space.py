"""The free numbers of a manoeuvre as a point in the unit cube, for the optimiser."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.excite.manoeuvre import THROTTLE, control_limits
from sysid_node.excite.prediction import Predictor
from sysid_node.excite.segment import ManoeuvreSegment

Array = NDArray[np.float64]

#: Shortest and longest step (s); smallest and largest amplitude as a share of the control's travel. Both are searched
#: in logarithms.
_WIDTHS = (0.1, 2.0)
_SHARES = (0.01, 0.95)
#: Seconds of trimmed flight before the manoeuvre.
_LEAD = 1.0


@dataclass(frozen=True)
class SearchSpace:
    """Amplitudes, beginnings and, of steps, widths of ``segments``, flown by ``predictor`` within ``duration`` (s)."""

    predictor: Predictor
    segments: Sequence[ManoeuvreSegment]
    duration: float

    @property
    def size(self) -> int:
        """The number of free numbers."""
        return sum(len(segment.controls) + 1 + ("width" in segment.values) for segment in self.segments)

    @property
    def travel(self) -> dict[str, float]:
        """How far each control may move from trim to either side; half a radian where nothing limits it."""
        trim = dict(zip(self.predictor.simulator.commands, self.predictor.trim.command.tolist(), strict=True))
        room: dict[str, float] = {}
        for name, limit in control_limits(self.predictor.aircraft).items():
            if name == THROTTLE:
                share = trim["thrust"] / self.predictor.full_thrust
                room[name] = min(share, limit - share)
            else:
                room[name] = limit - abs(trim[name]) if np.isfinite(limit) else 0.5
        return room

    def encode(self, segments: Sequence[ManoeuvreSegment]) -> Array:
        """The point (size,) of these segments."""
        travel = self.travel
        point: list[float] = []
        for segment in segments:
            for control, amplitude in zip(segment.controls, segment.amplitude, strict=True):
                point.append(_place(abs(amplitude) / travel[control], *_SHARES))
            if "width" in segment.values:
                point.append(_place(segment.values["width"], *self._widths(segment)))
            point.append((segment.values["start"] - _LEAD) / max(self._room(segment), 1e-9))
        return np.clip(point, 0.0, 1.0)

    def decode(self, point: Array) -> list[ManoeuvreSegment]:
        """The segments of a point. Their numbers have four decimals, so that the spec in text is what is flown."""
        values, travel = iter(np.clip(point, 0.0, 1.0).tolist()), self.travel
        found: list[ManoeuvreSegment] = []
        for segment in self.segments:
            shares = [_value(next(values), *_SHARES) for _ in segment.controls]
            amplitude = tuple(
                _round(float(np.sign(a) or 1.0) * share * travel[c])
                for a, share, c in zip(segment.amplitude, shares, segment.controls, strict=True)
            )
            changed = dict(segment.values)
            if "width" in changed:
                changed["width"] = _round(_value(next(values), *self._widths(segment)))
            moved = replace(segment, amplitude=amplitude, values=changed)
            changed["start"] = _round(_LEAD + next(values) * self._room(moved))
            found.append(replace(moved, values=changed))
        return found

    def _room(self, segment: ManoeuvreSegment) -> float:
        """The latest start of the segment (s after the lead) with which it still ends in time."""
        return max(self.duration - _span(segment) - _LEAD, 0.0)

    def _widths(self, segment: ManoeuvreSegment) -> tuple[float, float]:
        """Shortest and longest width (s) of a segment of steps that ends in time; its span is linear in the width."""
        shortest, longest = _WIDTHS
        first, second = (_span(replace(segment, values={**segment.values, "width": w})) for w in _WIDTHS)
        slope = (second - first) / (longest - shortest)
        fitting = shortest + (self.duration - _LEAD - first) / slope
        return shortest, min(max(fitting, 1.01 * shortest), longest)


def _span(segment: ManoeuvreSegment) -> float:
    """Seconds from the start of the first repetition to the end of the last."""
    return segment.end - segment.values["start"]


def _place(value: float, low: float, high: float) -> float:
    """The position of a value between low and high on a logarithmic scale, 0 to 1."""
    return float(np.log(max(value, low) / low) / np.log(high / low))


def _value(place: float, low: float, high: float) -> float:
    """The inverse of ``_place``."""
    return float(low * (high / low) ** place)


def _round(value: float) -> float:
    """The value with four decimals, rounded towards zero so that it stays within its limit; up to rounding errors."""
    return math.trunc(value * 1e4 + math.copysign(1e-6, value)) / 1e4
