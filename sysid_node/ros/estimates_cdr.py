"""Estimates as serialised messages, made without an object for every number; no ROS is needed.

A message of estimates holds about 200 numbers at places that its names and statuses decide, and these seldom change.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import lru_cache
from operator import attrgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.cdr_layout import Layout
from sysid_node.flight.cdr_single import SingleWriter
from sysid_node.flight.streams import Stamps
from sysid_node.flight.topics import DERIVATIVES_TYPE
from sysid_node.online.rows import DerivativeRows, FitRows
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality

Array = NDArray[np.float64]
_STAMP = ("header.stamp.sec",), ("header.stamp.nanosec",)
_NUMBERS = ("value", "standard_error", "lower", "upper")
_FIT_NUMBERS = ("r_squared", "residual_std", "degrees_of_freedom")
_REMEMBERED = 64  # layouts


class Types(Protocol):
    """Messages by the name of their type: ``flight.messages.StoreTypes`` for bags, ``message_types.RosTypes`` live."""

    def make(self, msgtype: str, /, **fields: Any) -> Any:
        """A message."""

    def layout(self, msgtype: str, message: Any) -> Layout:
        """The layout of a message once it is serialised."""


class EstimatesSerialiser:
    """Makes sysid_msgs/DerivativeEstimates of one ``aircraft`` and ``method``."""

    def __init__(self, types: Types, aircraft: str, method: str) -> None:
        self._types, self._said = types, {"aircraft": aircraft, "method": method}
        self._writers = lru_cache(_REMEMBERED)(self._writer)

    def many(self, history: Sequence[Estimates], stamps_ns: Stamps, frame_id: str) -> list[bytes]:
        """Messages of K estimates with ``stamps_ns`` (K,)."""
        messages: list[bytes] = [b""] * len(history)
        groups: dict[Hashable, list[int]] = {}
        for i, estimates in enumerate(history):
            groups.setdefault(_strings(estimates), []).append(i)
        for strings, places in groups.items():
            some, stamps = [history[i] for i in places], stamps_ns[places]
            derivatives = np.array([_derivatives(estimates.derivatives) for estimates in some])
            fits = np.array([_fits(estimates.fits) for estimates in some])
            columns = [derivatives, fits[:, :, :-1], fits[:, :, -1]]
            numbers = [column.reshape(len(some), -1) for column in columns]
            found = self._writers(frame_id, strings).write(*divmod(stamps[:, None], 1_000_000_000), *numbers)
            for i, message in zip(places, found, strict=True):
                messages[i] = message
        return messages

    def one(self, estimates: Estimates, stamp_ns: int, frame_id: str) -> bytes:
        """The message of estimates with the stamp ``stamp_ns``."""
        return self.many([estimates], np.array([stamp_ns]), frame_id)[0]

    def _writer(self, frame_id: str, strings: tuple[tuple[str, ...], ...]) -> SingleWriter:
        """The writer of messages with these names, statuses, and coefficients."""
        names, statuses, coefficients = strings
        make, blank = self._types.make, dict.fromkeys(_NUMBERS, 0.0)
        message = make(
            DERIVATIVES_TYPE,
            header=make(
                "std_msgs/msg/Header", stamp=make("builtin_interfaces/msg/Time", sec=0, nanosec=0), frame_id=frame_id
            ),
            derivatives=[
                make("sysid_msgs/msg/DerivativeEstimate", name=name, valid=status == "ok", status=status, **blank)
                for name, status in zip(names, statuses, strict=True)
            ],
            fits=[
                make("sysid_msgs/msg/FitQuality", coefficient=name, samples=0, **dict.fromkeys(_FIT_NUMBERS, 0.0))
                for name in coefficients
            ],
            **self._said,
        )
        layout = self._types.layout(DERIVATIVES_TYPE, message)
        return SingleWriter(
            layout,
            *_STAMP,
            _paths("derivatives", len(names), _NUMBERS),
            _paths("fits", len(coefficients), _FIT_NUMBERS),
            _paths("fits", len(coefficients), ("samples",)),
        )


def _paths(field: str, count: int, names: Sequence[str]) -> list[str]:
    """Paths of ``count`` parts' numbers: derivatives.3.value."""
    return [f"{field}.{i}.{name}" for i in range(count) for name in names]


def _strings(estimates: Estimates) -> tuple[tuple[str, ...], ...]:
    """What decides how the message is laid out: names, statuses, coefficients."""
    derivatives, fits = estimates.derivatives, estimates.fits
    if isinstance(derivatives, DerivativeRows) and isinstance(fits, FitRows):
        return derivatives.names, derivatives.statuses, fits.names
    return tuple(derivatives), tuple(row.status for row in derivatives.values()), tuple(fits)


def _derivatives(rows: Mapping[str, DerivativeEstimate]) -> Array:
    """(n, 4) what ``_NUMBERS`` names of n derivatives."""
    return rows.numbers.T if isinstance(rows, DerivativeRows) else _table(rows, attrgetter(*_NUMBERS), len(_NUMBERS))


def _fits(rows: Mapping[str, FitQuality]) -> Array:
    """(n, 4) what ``_FIT_NUMBERS`` names of n coefficients, and the samples."""
    if isinstance(rows, FitRows):
        return np.column_stack([rows.r_squared, rows.rest])
    return _table(rows, attrgetter(*_FIT_NUMBERS, "samples"), len(_FIT_NUMBERS) + 1)


def _table(rows: Mapping[str, Any], numbers: Callable[[Any], tuple[float, ...]], width: int) -> Array:
    return np.array([numbers(row) for row in rows.values()], np.float64).reshape(-1, width)
