"""Estimates over time, kept on the disk: those of six hours at 20 Hz are 430,000, and would fill the memory."""

from __future__ import annotations

import os
import tempfile
from array import array
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from sysid_node.errors import InputError
from sysid_node.online.estimates.rows import DERIVATIVE_NUMBERS, DerivativeRows, FitRows
from sysid_node.online.status import Vocabulary
from sysid_node.online.types import DerivativeEstimate, Estimates

Array = NDArray[np.float64]
_AT_ONCE = 256  # estimates that are read or written together
_FIT_NUMBERS = 4


class _Shape(NamedTuple):
    """What many estimates have in common, so that it is kept once."""

    names: tuple[str, ...]
    vocabulary: Vocabulary | None  # None: the statuses are in ``said``
    said: tuple[tuple[bool, str], ...]  # valid and status of derivatives, where nothing was solved for
    fits: tuple[str, ...]
    servos: tuple[tuple[str, bool, str], ...]  # name, valid and status

    @property
    def numbers(self) -> int:
        """Numbers of float64 in a record, the time being the first."""
        rows = (len(self.names) + len(self.servos)) * len(DERIVATIVE_NUMBERS)
        return 1 + rows + len(self.fits) * _FIT_NUMBERS

    @property
    def size(self) -> int:
        """Bytes of a record."""
        return 8 * self.numbers + (len(self.names) if self.vocabulary else 0)


class EstimatesLog(Sequence[Estimates]):
    """Estimates in a temporary file, as a sequence to which more can be added.

    What is read back is what was added, to the last bit, but for the budget of the variances, which is not kept. The
    file has no name and is gone with this object. Raises InputError where the disk is full.
    """

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115  # closed with this object
        self._shapes: list[_Shape] = []
        self._known: dict[tuple[object, ...], int] = {}
        self._shape, self._place = array("H"), array("Q")
        self._waiting: list[bytes] = []
        self._end = 0

    def append(self, estimates: Estimates) -> None:
        """Add the next estimates."""
        shape = self._shape_of(estimates)
        kind = self._shapes[shape]
        derivatives, fits = estimates.derivatives, estimates.fits
        of_derivatives = (
            derivatives.numbers if isinstance(derivatives, DerivativeRows) else _table(derivatives.values())
        )
        of_fits = fits.numbers if isinstance(fits, FitRows) else np.empty(0)
        parts = [
            np.array([estimates.time]),
            of_derivatives.ravel(),
            of_fits.ravel(),
            _table(estimates.servos.values()).ravel(),
        ]
        record = np.concatenate(parts).tobytes()
        if isinstance(derivatives, DerivativeRows):
            record += derivatives.codes.tobytes()
        assert len(record) == kind.size
        self._shape.append(shape)
        self._place.append(self._end)
        self._waiting.append(record)
        self._end += len(record)
        if len(self._waiting) == _AT_ONCE:
            self._flush()

    def __len__(self) -> int:
        return len(self._shape)

    @overload
    def __getitem__(self, place: int) -> Estimates: ...

    @overload
    def __getitem__(self, place: slice) -> list[Estimates]: ...

    def __getitem__(self, place: int | slice) -> Estimates | list[Estimates]:
        self._flush()
        if isinstance(place, slice):
            return [self._read(i) for i in range(*place.indices(len(self)))]
        if not -len(self) <= place < len(self):
            raise IndexError(place)
        return self._read(place % len(self))

    def __iter__(self) -> Iterator[Estimates]:
        for start in range(0, len(self), _AT_ONCE):
            yield from self[start : start + _AT_ONCE]

    def __del__(self) -> None:
        self._file.close()

    def _flush(self) -> None:
        try:
            self._file.seek(0, os.SEEK_END)
            self._file.write(b"".join(self._waiting))
            self._file.flush()
        except OSError as error:
            raise InputError(
                f"{tempfile.gettempdir()}: estimates cannot be kept there ({error.strerror}); make room, or set TMPDIR"
            ) from None
        self._waiting.clear()

    def _shape_of(self, estimates: Estimates) -> int:
        """The place of the estimates' shape among those known."""
        derivatives = estimates.derivatives
        rows = isinstance(derivatives, DerivativeRows)
        shape = _Shape(
            tuple(derivatives),
            derivatives.vocabulary if isinstance(derivatives, DerivativeRows) else None,
            () if rows else tuple((row.valid, row.status) for row in derivatives.values()),
            tuple(estimates.fits),
            tuple((row.name, row.valid, row.status) for row in estimates.servos.values()),
        )
        key = (shape.names, id(shape.vocabulary), *shape[2:])
        if key not in self._known:
            self._known[key] = len(self._shapes)
            self._shapes.append(shape)
        return self._known[key]

    def _read(self, place: int) -> Estimates:
        shape = self._shapes[self._shape[place]]
        record = os.pread(self._file.fileno(), shape.size, self._place[place])
        numbers = np.frombuffer(record, np.float64, shape.numbers)
        ends = np.cumsum([1, len(shape.names) * len(DERIVATIVE_NUMBERS), len(shape.fits) * _FIT_NUMBERS])
        time, of_derivatives, of_fits, of_servos = np.split(numbers, ends)
        rows = of_derivatives.reshape(len(shape.names), len(DERIVATIVE_NUMBERS))
        servos = of_servos.reshape(len(shape.servos), len(DERIVATIVE_NUMBERS))
        return Estimates(
            float(time[0]),
            DerivativeRows(
                shape.names, rows, np.frombuffer(record, np.uint8, offset=8 * shape.numbers), shape.vocabulary
            )
            if shape.vocabulary
            else _rows(shape.names, rows, shape.said),
            FitRows(shape.fits, of_fits.reshape(len(shape.fits), _FIT_NUMBERS)) if shape.fits else {},
            _rows([name for name, *_ in shape.servos], servos, [(valid, status) for _, valid, status in shape.servos]),
        )


def _table(rows: Iterable[DerivativeEstimate]) -> Array:
    """(n, 6) what ``DERIVATIVE_NUMBERS`` names."""
    return np.array([[getattr(row, name) for name in DERIVATIVE_NUMBERS] for row in rows])


def _rows(names: Sequence[str], table: Array, said: Sequence[tuple[bool, str]]) -> dict[str, DerivativeEstimate]:
    """Estimates by name, from the rows of ``_table`` and whether each is valid with its status."""
    found = {}
    for name, numbers, (valid, status) in zip(names, table.tolist(), said, strict=True):
        value, error, statistical, systematic, lower, upper = numbers
        found[name] = DerivativeEstimate(name, value, error, lower, upper, valid, status, statistical, systematic)
    return found
