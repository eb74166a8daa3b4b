"""What the work on one flight is given, and what it gives back; both travel between the command and a worker."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class FleetSettings:
    """What is done with every flight: ``method`` of ``sysid identify``, or empty for the replay; and how it is read.

    ``gap``: whether it is diagnosed. ``reports``: whether its own report is written. ``settings``: of the method.
    """

    method: str = ""
    settings: Mapping[str, object] = field(default_factory=dict)
    gap: bool = False
    reports: bool = False
    topics: tuple[str, ...] = ()
    body_frame: BodyFrame = "flu"

    def as_dict(self) -> dict[str, object]:
        """The settings as JSON has them."""
        return {**vars(self), "settings": dict(self.settings), "topics": list(self.topics)}


@dataclass(frozen=True)
class FlightTask:
    """A flight to be worked on."""

    flight: str
    location: str  # a path, or an address that fsspec opens
    aircraft: Aircraft
    settings: FleetSettings
    cache: str = ""  # folder for copies of remote logs; empty: the user's cache


@dataclass(frozen=True)
class FlightOutcome:
    """What came of a flight; arrays as in ``results.FlightResult``.

    ``vehicle`` and ``date`` are what the log says: empty and None where it does not. ``files`` are those of the
    flight's own report, by name.
    """

    aircraft: str
    vehicle: str
    date: datetime.datetime | None
    data_seconds: float
    names: tuple[str, ...]
    values: Array
    covariance: Array
    statistical_covariance: Array
    valid: np.typing.NDArray[np.bool_]
    gap: Mapping[str, Any] | None = None
    report: str = ""  # which of the files is the report; empty: none
    files: Mapping[str, bytes] = field(default_factory=dict)
