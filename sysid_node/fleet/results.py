"""What a fleet's flights gave: the estimates of each with their covariance, what was refused, and maintenance."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid_node.flight.record import Array


@dataclass(frozen=True)
class FlightResult:
    """The estimates of one flight.

    ``flight`` is its identity in the catalogue, ``aircraft`` the type (the name of its aircraft file), ``tail`` the
    individual, ``configuration`` a word for how it was equipped (empty: as usual), and ``date`` its start in UTC.
    ``names``, ``values`` and ``valid`` (n,) are the derivatives, which ones the estimator says are valid, and
    ``covariance`` (n, n) the covariance of all their errors; ``statistical_covariance`` (n, n) is the part that
    another flight of the same aircraft draws anew. A covariance has the product of two estimates' units; per radian
    as everywhere. ``gap`` is the content of the flight's ``gap.json``, None where it was not diagnosed, and ``report``
    the path of the flight's own report relative to the fleet's folder, None where it has none. ``remarks`` are what the
    command of a single flight would have warned of.
    """

    flight: str
    aircraft: str
    tail: str
    configuration: str
    date: datetime.datetime
    data_seconds: float
    names: tuple[str, ...]
    values: Array
    covariance: Array
    statistical_covariance: Array
    valid: np.typing.NDArray[np.bool_]
    gap: Mapping[str, Any] | None
    report: str | None
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Raise ValueError where shapes differ or the date has no time zone."""
        n = len(self.names)
        for name, shape in (
            ("values", (n,)),
            ("covariance", (n, n)),
            ("statistical_covariance", (n, n)),
            ("valid", (n,)),
        ):
            found = getattr(self, name).shape
            if found != shape:
                raise ValueError(f"{name} of flight {self.flight}: shape {found}, expected {shape}")
        if self.date.tzinfo is None:
            raise ValueError(f"date of flight {self.flight} has no time zone")


@dataclass(frozen=True)
class Refusal:
    """A flight without a result; ``reason`` is one line that says what was wrong, where, and what to do."""

    flight: str
    aircraft: str
    tail: str
    date: datetime.datetime | None
    reason: str


@dataclass(frozen=True)
class MaintenanceNote:
    """What was done to an aircraft, and when (UTC); ``aircraft`` is its type, empty for any with that tail."""

    tail: str
    date: datetime.datetime
    text: str
    aircraft: str = ""

    def concerns(self, aircraft: str, tail: str) -> bool:
        """Whether it was done to this tail of this type."""
        return self.tail == tail and self.aircraft in ("", aircraft)


@dataclass(frozen=True)
class FleetResults:
    """All that a fleet's flights gave; ``flights`` are sorted by tail and date."""

    flights: tuple[FlightResult, ...]
    refusals: tuple[Refusal, ...]
    maintenance: tuple[MaintenanceNote, ...]
