"""Estimates as a bag, so that ``ros2 bag play``, PlotJuggler and Foxglove show them as if they were live."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.store import Typestore

from sysid_node.flight.bag_writer import add_topic, header, new_bag, stamp_columns
from sysid_node.flight.cdr import encode, layout_of
from sysid_node.flight.messages import type_store
from sysid_node.flight.streams import Stamps
from sysid_node.flight.topics import DERIVATIVES, DERIVATIVES_TYPE
from sysid_node.online.rows import DerivativeRows, FitRows
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality

Array = NDArray[np.float64]

_NUMBERS = ("value", "standard_error", "lower", "upper", "valid")
_FIT_NUMBERS = ("r_squared", "residual_std", "degrees_of_freedom", "samples")


def write_estimates(
    path: Path, history: Sequence[Estimates], stamps_ns: Stamps, *, aircraft: str, method: str, frame_id: str
) -> None:
    """DerivativeEstimates on /identifier/derivatives, each stamped and logged at the sample that it includes last.

    ``stamps_ns`` (K,) of ``history`` (K,). Raises InputError where the bag exists or cannot be written.
    """
    store = type_store()
    messages: list[bytes] = [b""] * len(history)
    for places in _alike(history):
        some = [history[i] for i in places]
        layout = layout_of(store, DERIVATIVES_TYPE, _template(store, some[0], aircraft, method, frame_id))
        columns = stamp_columns(stamps_ns[places])
        columns |= _columns("derivatives", _NUMBERS, [_derivatives(estimates.derivatives) for estimates in some])
        columns |= _columns("fits", _FIT_NUMBERS, [_fits(estimates.fits) for estimates in some])
        for i, data in zip(places, encode(layout, columns, len(some)), strict=True):
            messages[i] = data
    with new_bag(path) as writer:
        topic = add_topic(writer, DERIVATIVES, DERIVATIVES_TYPE)
        for stamp, data in zip(stamps_ns.tolist(), messages, strict=True):
            writer.write(topic, stamp, data)


def _alike(history: Sequence[Estimates]) -> Iterable[list[int]]:
    """Places of estimates whose messages are laid out alike: the same names and statuses."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for i, estimates in enumerate(history):
        derivatives = estimates.derivatives
        if isinstance(derivatives, DerivativeRows):
            statuses = derivatives.statuses
        else:
            statuses = tuple(d.status for d in derivatives.values())
        groups.setdefault((*derivatives, *statuses, *estimates.fits), []).append(i)
    return groups.values()


def _template(store: Typestore, estimates: Estimates, aircraft: str, method: str, frame_id: str) -> bytes:
    """One message, as rosbags writes it."""
    derivative, fit = (store.types[f"sysid_msgs/msg/{name}"] for name in ("DerivativeEstimate", "FitQuality"))
    message = store.types[DERIVATIVES_TYPE](
        header(store, frame_id),
        aircraft,
        method,
        [
            derivative(d.name, d.value, d.standard_error, d.lower, d.upper, d.valid, d.status)
            for d in estimates.derivatives.values()
        ],
        [
            fit(f.coefficient, f.r_squared, f.residual_std, f.degrees_of_freedom, f.samples)
            for f in estimates.fits.values()
        ],
    )
    return bytes(store.serialize_cdr(message, DERIVATIVES_TYPE))


def _derivatives(rows: Mapping[str, DerivativeEstimate]) -> Array:
    """(n, 5) what ``_NUMBERS`` names of n derivatives."""
    if isinstance(rows, DerivativeRows):
        return np.vstack([rows.numbers, rows.valid]).T
    return _table(rows, _NUMBERS)


def _fits(rows: Mapping[str, FitQuality]) -> Array:
    """(n, 4) what ``_FIT_NUMBERS`` names of n coefficients."""
    if isinstance(rows, FitRows):
        return np.column_stack([rows.r_squared, rows.rest])
    return _table(rows, _FIT_NUMBERS)


def _table(rows: Mapping[str, Any], names: Sequence[str]) -> Array:
    return np.array([attrgetter(*names)(row) for row in rows.values()], np.float64).reshape(-1, len(names))


def _columns(field: str, names: Sequence[str], tables: Sequence[Array]) -> dict[str, Any]:
    """Columns of a sequence of parts: ``derivatives.3.value`` -> (n,), of n messages with equally many parts."""
    table = np.array(tables)
    return {f"{field}.{i}.{name}": table[:, i, j] for i in range(table.shape[1]) for j, name in enumerate(names)}
