"""The kinds of manoeuvre that a spec can name, with their keys and the inputs that they give."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.excite import shapes
from sysid_node.excite.multisine import multisine

Array = NDArray[np.float64]
Values = Mapping[str, float]


@dataclass(frozen=True)
class ManoeuvreKey:
    """A number of a manoeuvre: its default, unit and meaning, and whether it must be above zero."""

    default: float
    unit: str
    meaning: str
    positive: bool = True


@dataclass(frozen=True)
class ManoeuvreKind:
    """One kind of manoeuvre.

    ``draw(time, values, count)`` gives the inputs (count, N) with a peak of one, zero outside 0 to ``length(values)``
    s.
    """

    meaning: str
    keys: Mapping[str, ManoeuvreKey]
    length: Callable[[Values], float]
    draw: Callable[[Array, Values, int], Array]
    orthogonal: bool = False  # whether the inputs of several controls that move at once are uncorrelated


#: Keys of every kind, besides ``amplitude`` (rad; one for all controls of the segment, or one each).
COMMON_KEYS = {
    "start": ManoeuvreKey(1.0, "s", "when it begins", positive=False),
    "repeat": ManoeuvreKey(1.0, "", "how often it is flown"),
    "every": ManoeuvreKey(0.0, "s", "from one beginning to the next; 0: one second after the last end", positive=False),
}

_BAND = {
    "length": ManoeuvreKey(20.0, "s", "how long it lasts"),
    "low": ManoeuvreKey(0.1, "Hz", "lowest frequency"),
    "high": ManoeuvreKey(2.0, "Hz", "highest frequency"),
}


def _steps(meaning: str, *pattern: float) -> ManoeuvreKind:
    def draw(time: Array, values: Values, count: int) -> Array:
        return np.tile(shapes.multistep(time, pattern, values["width"]), (count, 1))

    keys = {"width": ManoeuvreKey(0.5, "s", "length of the unit step")}
    return ManoeuvreKind(meaning, keys, lambda values: sum(pattern) * values["width"], draw)


def _ramp(time: Array, values: Values, count: int) -> Array:
    return np.tile(shapes.ramp(time, values["length"]), (count, 1))


def _sweep(time: Array, values: Values, count: int) -> Array:
    return np.tile(shapes.sweep(time, values["length"], values["low"], values["high"]), (count, 1))


def _random(time: Array, values: Values, count: int) -> Array:
    """Independent noise for each control."""
    length, low, high, seed = values["length"], values["low"], values["high"], int(values["seed"])
    return np.array([shapes.random(time, length, low, high, seed + i) for i in range(count)])


def _multisine(time: Array, values: Values, count: int) -> Array:
    return multisine(time, values["length"], values["low"], values["high"], count)


def _length(values: Values) -> float:
    return values["length"]


KINDS: Mapping[str, ManoeuvreKind] = {
    "pulse": _steps("one step and back", 1),
    "doublet": _steps("a step, its opposite, and back", 1, 1),
    "211": _steps("steps of 2, 1 and 1 units, alternating", 2, 1, 1),
    "3211": _steps("steps of 3, 2, 1 and 1 units, alternating", 3, 2, 1, 1),
    "ramp": ManoeuvreKind("a slow triangle", {"length": ManoeuvreKey(20.0, "s", "how long it lasts")}, _length, _ramp),
    "sweep": ManoeuvreKind("a sine of growing frequency", _BAND, _length, _sweep),
    "random": ManoeuvreKind(
        "band-limited Gaussian noise, another for each control",
        {**_BAND, "seed": ManoeuvreKey(1.0, "", "of the random numbers", positive=False)},
        _length,
        _random,
        orthogonal=True,
    ),
    "multisine": ManoeuvreKind(
        "orthogonal multisines on all its controls at once", _BAND, _length, _multisine, orthogonal=True
    ),
}
