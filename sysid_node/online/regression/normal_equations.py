"""The normal equations of all coefficients as entries of one Gram matrix.

All coefficients with the same regressors share one factorisation; the groups stand as blocks on the diagonal of one
matrix, so that one call solves for all six coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.regression_signals import SignalLayout

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: F statistic of an instrument under which estimates that rest on it are not to be trusted.
STRONG = 25.0


@dataclass(frozen=True)
class NormalEquations:
    """Which entries of the W x W Gram matrix make the normal equations. P unknowns (blocks), C coefficients."""

    coefficients: tuple[str, ...]
    regressors: tuple[str, ...]  # of each unknown
    group: Index  # (P,) block of each unknown
    block: Index  # (C,) block of each coefficient
    columns: Index  # (P,) column of each unknown's regressor
    outputs: Index  # (C,) column of each coefficient
    instruments: Index  # (P,) column of each unknown's instrument: its regressor, in least squares
    same_block: Array  # (P, P) 1 where two unknowns belong to one block
    belongs: Array  # (P, C) 1 where the unknown belongs to the coefficient
    width: int  # W
    # flat indices into the Gram matrix; transposed, so that LAPACK takes what is gathered as it lies
    entries: Index = field(init=False)  # (2, P + C, P) of A'A above A'y, and of Z'A above Z'y
    sides: Index = field(init=False)  # (P + C,) columns of the regressors, then of the coefficients
    square: Index = field(init=False)  # (C,) of y'y
    energy: Index = field(init=False)  # (P,) of x'x
    counted: Array = field(init=False)  # (2, P + C, P) 1 where the entry lies in a block, of A'y 2: see ``solve``
    unit: Array = field(init=False)  # (P, P)
    known: Array = field(init=False)  # (P + C, P) the unit matrix, and room for what is known
    instrumented: NDArray[np.bool_] = field(init=False)  # (C,) whether any of its regressors has an instrument
    least_squares: bool = field(init=False)  # whether every regressor is its own instrument
    variants: dict[tuple[int, ...], NormalEquations] = field(init=False, default_factory=dict, repr=False)  # kept

    def __post_init__(self) -> None:
        both = np.concatenate([self.columns, self.outputs])[:, None]
        plain = bool((self.columns == self.instruments).all())
        sources = self.columns, self.instruments
        object.__setattr__(self, "sides", both[:, 0])
        object.__setattr__(self, "entries", np.stack([both + rows * self.width for rows in sources]))
        object.__setattr__(self, "square", self.outputs * (self.width + 1))
        object.__setattr__(self, "energy", self.columns * (self.width + 1))
        counted = [np.vstack([self.same_block, times * self.belongs.T]) for times in (2.0, 1.0)]
        object.__setattr__(self, "counted", np.stack(counted))
        object.__setattr__(self, "unit", np.eye(self.columns.size))
        object.__setattr__(self, "known", np.eye(both.size, self.columns.size))
        object.__setattr__(self, "instrumented", (self.belongs.T @ (self.columns != self.instruments)) > 0.0)
        object.__setattr__(self, "least_squares", plain)

    def unknowns(self, coefficient: int) -> Index:
        """Indices of a coefficient's unknowns."""
        return np.flatnonzero(self.group == self.block[coefficient])


def normal_equations(structure: dict[str, tuple[str, ...]], layout: SignalLayout) -> NormalEquations:
    """Normal equations for a model structure, e.g. ``{"Cm": ("0", "alpha", "q", "de")}``; offsets come after."""
    slopes = {c: tuple(r for r in rs if r != "0") for c, rs in structure.items()}
    blocks = list(dict.fromkeys(slopes.values()))
    regressors = tuple(r for block in blocks for r in block)
    group = np.array([i for i, block in enumerate(blocks) for _ in block], dtype=np.intp)
    block = np.array([blocks.index(rs) for rs in slopes.values()], dtype=np.intp)
    return NormalEquations(
        coefficients=tuple(slopes),
        regressors=regressors,
        group=group,
        block=block,
        columns=np.array([layout.column(r) for r in regressors], dtype=np.intp),
        outputs=np.array([layout.column(c) for c in slopes], dtype=np.intp),
        instruments=np.array([layout.instrument(r) for r in regressors], dtype=np.intp),
        same_block=(group[:, None] == group).astype(float),
        belongs=(group[:, None] == block).astype(float),
        width=layout.width,
    )


def with_strong_instruments(full: NormalEquations, strength: Array) -> NormalEquations:
    """The equations, with least squares in blocks that have a weak instrument: a small bias beats a huge variance."""
    weak = full.group[strength < STRONG].tolist()
    return with_least_squares_in(full, tuple(sorted(set(weak)))) if weak else full


def with_least_squares_in(full: NormalEquations, blocks: tuple[int, ...]) -> NormalEquations:
    """The equations, with least squares in these blocks; made once and kept in ``variants``."""
    if blocks not in full.variants:
        chosen = np.isin(full.group, blocks)
        full.variants[blocks] = replace(full, instruments=np.where(chosen, full.columns, full.instruments))
    return full.variants[blocks]
