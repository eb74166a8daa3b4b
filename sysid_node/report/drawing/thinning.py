"""Long records thinned for storing and drawing, so that no peak is lost.

Each bucket of neighbouring samples keeps its smallest and its largest value, and one gap where it has a
gap: on a plot narrower than the number of buckets the curve looks the same as with all samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array, FlightRecord

#: Rows of ``signals.csv`` at most: eight minutes of sixteen columns still show one second.
MAX_ROWS = 16_000
#: Points of one drawn curve at most.
MAX_POINTS = 1_500


def extremes(values: Array, buckets: int) -> NDArray[np.intp]:
    """Indices, increasing, of the first and last sample and of each bucket's minimum, maximum and first gap.

    ``values`` (N,), NaN = gap. All indices where N is at most three times ``buckets``.
    """
    count = values.size
    if count <= 3 * buckets:
        return np.arange(count)
    size = -(-count // buckets)
    padded = np.concatenate([values, np.full(-count % size, values[-1])]).reshape(-1, size)
    gap = np.isnan(padded)
    picks = [
        np.where(gap, np.inf, padded).argmin(axis=1),
        np.where(gap, -np.inf, padded).argmax(axis=1),
        gap.argmax(axis=1),
    ]
    start = np.arange(padded.shape[0]) * size
    return np.unique(np.clip(np.concatenate([[0, count - 1], *(start + pick for pick in picks)]), 0, count - 1))


def extreme_rows(columns: Array) -> NDArray[np.intp]:
    """Rows, increasing, that hold the extremes of all columns (N, M), as those of ``extremes`` in one bucket."""
    return np.unique(np.concatenate([extremes(column, 1) for column in columns.T]))


def thin_curve(time: Array, *curves: Array, points: int = MAX_POINTS) -> tuple[Array, ...]:
    """Times and curves, each (N,), at the rows that hold the extremes of every curve."""
    rows = _rows(curves, points)
    return (time[rows], *(curve[rows] for curve in curves))


def thin_flight(flight: FlightRecord) -> FlightRecord:
    """The record where it is short, else at most ``MAX_ROWS`` of its samples: those with the columns' extremes."""
    if len(flight) <= MAX_ROWS:
        return flight
    rows = _rows(tuple(flight.columns.values()), MAX_ROWS)
    columns = {name: values[rows] for name, values in flight.columns.items()}
    return FlightRecord(flight.time[rows], columns, flight.name, flight.start_ns, flight.rejected)


def _rows(curves: tuple[Array, ...], most: int) -> NDArray[np.intp]:
    """Rows holding the extremes of all curves, at most ``most`` of them."""
    if curves[0].size <= most:
        return np.arange(curves[0].size)
    buckets = max((most - 3 * len(curves)) // (3 * len(curves)), 1)
    return np.unique(np.concatenate([extremes(curve, buckets) for curve in curves]))
