"""Estimates as serialised messages, made without an object for every number; no ROS is needed.

A message of estimates holds about 200 numbers at places that its names and statuses decide, and these seldom change.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import lru_cache
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.cdr.layout import Definitions
from sysid_node.flight.cdr.template import Template, Templates
from sysid_node.flight.streams import Stamps
from sysid_node.flight.topics import DERIVATIVES_TYPE
from sysid_node.online.estimates.rows import DERIVATIVE_NUMBERS, DerivativeRows, FitRows
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality

Array = NDArray[np.float64]
_FIT_NUMBERS = ("r_squared", "residual_std", "degrees_of_freedom")
_REMEMBERED = 64  # templates


class EstimatesSerialiser:
    """Makes sysid_msgs/DerivativeEstimates of one ``aircraft`` and ``method``, by its ``definitions``."""

    def __init__(self, definitions: Definitions, aircraft: str, method: str) -> None:
        self._said, self._templates = (aircraft, method), Templates(definitions)
        self._template = lru_cache(_REMEMBERED)(self._make)

    def many(self, history: Sequence[Estimates], stamps_ns: Stamps, frame_id: str) -> list[bytes]:
        """Messages of K estimates with ``stamps_ns`` (K,)."""
        messages: list[bytes] = [b""] * len(history)
        groups: dict[Hashable, list[int]] = {}
        for i, estimates in enumerate(history):
            groups.setdefault(_alike(estimates), []).append(i)
        for places in groups.values():
            some = [history[i] for i in places]
            for i, message in zip(places, self._write(some, stamps_ns[places], frame_id), strict=True):
                messages[i] = message
        return messages

    def one(self, estimates: Estimates, stamp_ns: int, frame_id: str) -> bytes:
        """The message of estimates with the stamp ``stamp_ns``."""
        return self._write([estimates], np.array([stamp_ns]), frame_id)[0]

    def _write(self, history: Sequence[Estimates], stamps_ns: Stamps, frame_id: str) -> list[bytes]:
        """Messages of estimates that have the same names and statuses."""
        template = self._template(frame_id, *_strings(history[0]))
        seconds, nanoseconds = divmod(stamps_ns[:, None], 1_000_000_000)
        derivatives = np.array([_derivatives(estimates.derivatives) for estimates in history])
        fits = np.array([_fits(estimates.fits) for estimates in history])
        servos = np.array([_derivatives(estimates.servos) for estimates in history])
        numbers = [part.reshape(len(history), -1) for part in (derivatives, fits[:, :, :-1], servos)]
        columns = {"i4": seconds, "u4": nanoseconds, "f8": np.concatenate(numbers, axis=1), "u8": fits[:, :, -1]}
        return template.write(**{kind: column for kind, column in columns.items() if column.size})

    def _make(
        self,
        frame_id: str,
        names: tuple[str, ...],
        statuses: tuple[str, ...],
        coefficients: tuple[str, ...],
        servos: tuple[tuple[str, str], ...],
    ) -> Template:
        """The template of messages with these names, statuses, and coefficients."""
        blank, blank_fit = (0.0,) * len(DERIVATIVE_NUMBERS), (0.0,) * len(_FIT_NUMBERS)
        header = ((0, 0), frame_id)
        derivatives, of_servos = (
            tuple((name, *blank, status == "ok", status) for name, status in rows)
            for rows in (zip(names, statuses, strict=True), servos)
        )
        fits = tuple((coefficient, *blank_fit, 0) for coefficient in coefficients)
        return self._templates.template(DERIVATIVES_TYPE, (header, *self._said, derivatives, fits, of_servos))


def _alike(estimates: Estimates) -> Hashable:
    """What is equal where names and statuses are."""
    derivatives, fits = estimates.derivatives, estimates.fits
    if isinstance(derivatives, DerivativeRows) and isinstance(fits, FitRows):
        return derivatives.names, derivatives.codes.tobytes(), fits.names, _servos(estimates)
    return _strings(estimates)


_Servos = tuple[tuple[str, str], ...]  # names and statuses


def _strings(estimates: Estimates) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...], _Servos]:
    """Names, statuses, coefficients, servos."""
    derivatives, fits = estimates.derivatives, tuple(estimates.fits)
    if isinstance(derivatives, DerivativeRows):
        return derivatives.names, derivatives.statuses, fits, _servos(estimates)
    return tuple(derivatives), tuple(row.status for row in derivatives.values()), fits, _servos(estimates)


def _servos(estimates: Estimates) -> _Servos:
    return tuple((name, row.status) for name, row in estimates.servos.items())


def _derivatives(rows: Mapping[str, DerivativeEstimate]) -> Array:
    """(n, 6) what ``DERIVATIVE_NUMBERS`` names of n derivatives or servos."""
    if isinstance(rows, DerivativeRows):
        return rows.numbers
    return _table(rows, attrgetter(*DERIVATIVE_NUMBERS), len(DERIVATIVE_NUMBERS))


def _fits(rows: Mapping[str, FitQuality]) -> Array:
    """(n, 4) what ``_FIT_NUMBERS`` names of n coefficients, and the samples."""
    if isinstance(rows, FitRows):
        return rows.numbers
    return _table(rows, attrgetter(*_FIT_NUMBERS, "samples"), len(_FIT_NUMBERS) + 1)


def _table(rows: Mapping[str, Any], numbers: Callable[[Any], tuple[float, ...]], width: int) -> Array:
    return np.array([numbers(row) for row in rows.values()], np.float64).reshape(-1, width)
