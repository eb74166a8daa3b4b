"""The estimates of one derivative from all flights of a type, sorted by tail and date."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.fleet.results import FlightResult
from sysid_node.flight.record import Array

DAY = 86400.0  # s


@dataclass(frozen=True)
class DerivativeSeries:
    """Valid estimates of one derivative from N flights of one type, sorted by tail and date.

    ``tails`` are the names of the J tails and ``tail`` (N,) each flight's index among them. ``value``, ``statistical``
    and ``systematic`` (N,) are the estimate and its two standard errors in the derivative's unit; ``day`` (N,) the
    date in days since 1970; ``flight`` and ``configuration`` name each flight and how it was equipped.
    """

    aircraft: str
    name: str
    tails: tuple[str, ...]
    tail: NDArray[np.intp]
    value: Array
    statistical: Array
    systematic: Array
    day: Array
    flight: tuple[str, ...]
    configuration: tuple[str, ...]

    @property
    def count(self) -> int:
        """Number of flights."""
        return int(self.value.size)

    def of_tail(self, tail: str) -> DerivativeSeries:
        """The flights of one tail."""
        return self.where(self.tail == self.tails.index(tail))

    def where(self, keep: NDArray[np.bool_]) -> DerivativeSeries:
        """The flights for which ``keep`` (N,) holds, with the tails that are left."""
        present = np.unique(self.tail[keep])
        rows = np.flatnonzero(keep)
        return replace(
            self,
            tails=tuple(self.tails[t] for t in present),
            tail=np.searchsorted(present, self.tail[rows]),
            **{key: getattr(self, key)[rows] for key in ("value", "statistical", "systematic", "day")},
            flight=tuple(self.flight[row] for row in rows),
            configuration=tuple(self.configuration[row] for row in rows),
        )

    def with_values(self, value: Array) -> DerivativeSeries:
        """The same flights with other values (N,)."""
        return replace(self, value=value)


def series_by_type(flights: Sequence[FlightResult]) -> dict[tuple[str, str], DerivativeSeries]:
    """The series of every type and derivative that has a valid estimate, by (type, derivative).

    An estimate counts if the estimator marked it as valid and its value and errors are finite.
    """
    rows: dict[tuple[str, str], list[tuple[FlightResult, int]]] = {}
    for flight in sorted(flights, key=lambda f: (f.tail, f.date)):
        variances = np.diag(flight.covariance) + np.diag(flight.statistical_covariance)
        usable = flight.valid & np.isfinite(flight.values) & np.isfinite(variances)
        for k in np.flatnonzero(usable & (np.diag(flight.statistical_covariance) > 0.0)):
            rows.setdefault((flight.aircraft, flight.names[k]), []).append((flight, int(k)))
    return {key: _series(*key, found) for key, found in sorted(rows.items())}


def _series(aircraft: str, name: str, rows: Sequence[tuple[FlightResult, int]]) -> DerivativeSeries:
    tails = tuple(dict.fromkeys(flight.tail for flight, _ in rows))
    total = np.array([flight.covariance[k, k] for flight, k in rows])
    statistical = np.array([flight.statistical_covariance[k, k] for flight, k in rows])
    return DerivativeSeries(
        aircraft,
        name,
        tails,
        np.array([tails.index(flight.tail) for flight, _ in rows], dtype=np.intp),
        np.array([flight.values[k] for flight, k in rows]),
        np.sqrt(statistical),
        np.sqrt(np.maximum(total - statistical, 0.0)),
        np.array([flight.date.timestamp() / DAY for flight, _ in rows]),
        tuple(flight.flight for flight, _ in rows),
        tuple(flight.configuration for flight, _ in rows),
    )
