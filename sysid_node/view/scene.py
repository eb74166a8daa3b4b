"""What is shown of a flight, as plain arrays: the aircraft in space, curves against time, lanes, and notes.

Times are seconds of the flight. Vectors are in body axes, forward-right-down; positions are north-east-down, m.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from sysid_node.flight.record import Array

Colour = tuple[int, int, int]

#: Okabe and Ito's colours (2008), as in the reports.
BLUE, VERMILION, GREEN, PURPLE = (0, 114, 178), (213, 94, 0), (0, 158, 115), (170, 68, 153)
ORANGE, SKY, GREY, PALE = (230, 159, 0), (86, 180, 233), (138, 148, 160), (188, 197, 207)


@dataclass(frozen=True)
class PlotCurve:
    """One line of a plot: ``values`` (N,) at ``time`` (N,) s, in the panel's unit; NaN is a gap."""

    name: str
    time: Array
    values: Array
    colour: Colour = BLUE
    width: float = 1.5


@dataclass(frozen=True)
class PlotPanel:
    """One plot. ``span`` is the range of values that is shown at first; None: all of them."""

    title: str
    unit: str
    curves: Sequence[PlotCurve]
    span: tuple[float, float] | None = None


@dataclass(frozen=True)
class Arrow:
    """A vector (N, 3) at the aircraft, in body axes, drawn so many metres long per unit as ``metres_per_unit``."""

    name: str
    unit: str
    time: Array
    vectors: Array
    colour: Colour
    metres_per_unit: float


class DrawnAircraft(NamedTuple):
    """The measures of the drawn aircraft: span and chord, m, and which way its controls move.

    ``signs``: control symbol -> +1 or -1. +1 is a trailing edge that moves down (elevator, right aileron) or left
    (rudder) where the deflection is positive.
    """

    span: float = 2.0
    chord: float = 0.25
    signs: Mapping[str, float] = {"de": 1.0, "da": 1.0, "dr": 1.0}


@dataclass(frozen=True)
class Body:
    """An aircraft in space: ``position`` (N, 3) m north-east-down, ``attitude`` (N, 4), a quaternion, scalar first.

    ``controls``: symbol -> deflection (N,) rad, of those that are drawn.
    """

    name: str
    colour: Colour
    time: Array
    position: Array
    attitude: Array
    controls: Mapping[str, Array] = field(default_factory=dict)
    arrows: Sequence[Arrow] = ()
    path: bool = False  # whether its way is drawn as a line


#: The state of a lane in which nothing is drawn.
NOTHING = "nothing"


class LaneChange(NamedTuple):
    """From ``time`` (s) on a lane shows ``state``; ``NOTHING`` is a gap."""

    time: float
    state: str


@dataclass(frozen=True)
class Lane:
    """States over time, such as which control moves or which part has failed."""

    name: str
    changes: Sequence[LaneChange]
    colour: Colour = ORANGE


class Note(NamedTuple):
    """A sentence about a time (s) of the flight. ``level``: ``"INFO"``, ``"WARN"`` or ``"ERROR"``."""

    time: float
    text: str
    level: str = "INFO"


@dataclass(frozen=True)
class Scene:
    """All that is shown of a flight; each part may be empty. ``about`` is Markdown; ``tabs``: title -> panels."""

    title: str
    about: str
    shape: DrawnAircraft = field(default_factory=DrawnAircraft)
    bodies: Sequence[Body] = ()
    tabs: Mapping[str, Sequence[PlotPanel]] = field(default_factory=dict)
    lanes: Sequence[Lane] = ()
    notes: Sequence[Note] = ()
