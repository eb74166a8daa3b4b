"""Tables of estimates whose rows are made when they are first looked at.

Most estimates of a replay are only drawn or stored as columns; a Python object for each number of each of them would
take longer than solving for it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.status import OK, Codes, Vocabulary
from sysid_node.online.types import DerivativeEstimate, FitQuality

Array = NDArray[np.float64]
T = TypeVar("T")

#: Of a derivative, in the order of the message.
DERIVATIVE_NUMBERS = ("value", "standard_error", "statistical_error", "systematic_error", "lower", "upper")


class _Rows(Mapping[str, T]):
    """A table by name; a copy through pickle is a plain dictionary."""

    __slots__ = ("_rows", "names")

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self._rows: dict[str, T] | None = None

    @abstractmethod
    def _made(self) -> Iterator[T]:
        """The rows in the order of the names."""

    def _table(self) -> dict[str, T]:
        if self._rows is None:
            self._rows = dict(zip(self.names, self._made(), strict=True))
        return self._rows

    def __getitem__(self, name: str) -> T:
        return self._table()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        return repr(self._table())

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (self._table(),)


class DerivativeRows(_Rows[DerivativeEstimate]):
    """D derivatives: ``numbers`` (D, 6), see ``DERIVATIVE_NUMBERS``.

    ``codes`` (D,) are their statuses in the words of ``vocabulary``.
    """

    __slots__ = ("codes", "numbers", "vocabulary")

    def __init__(self, names: tuple[str, ...], numbers: Array, codes: Codes, vocabulary: Vocabulary) -> None:
        super().__init__(names)
        self.numbers, self.codes, self.vocabulary = numbers, codes, vocabulary

    def _made(self) -> Iterator[DerivativeEstimate]:
        value, error, statistical, systematic, lower, upper = self.numbers.T.tolist()
        columns = value, error, lower, upper, self.valid, self.statuses, statistical, systematic
        return map(DerivativeEstimate, self.names, *columns)

    @property
    def valid(self) -> list[bool]:
        """(D,) whether each is to be believed."""
        return [code == OK for code in self.codes.tolist()]

    @property
    def statuses(self) -> tuple[str, ...]:
        """(D,) statuses in words."""
        return self.vocabulary.texts(self.codes)


class FitRows(_Rows[FitQuality]):
    """C coefficients: ``numbers`` (C, 4) are R squared, residual's standard deviation, degrees of freedom, samples."""

    __slots__ = ("numbers",)

    def __init__(self, names: tuple[str, ...], numbers: Array) -> None:
        super().__init__(names)
        self.numbers = numbers

    def _made(self) -> Iterator[FitQuality]:
        *numbers, samples = self.numbers.T.tolist()
        return map(FitQuality, self.names, *numbers, map(int, samples))
