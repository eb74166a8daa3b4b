"""The normal equations of all coefficients as entries of one Gram matrix.

All coefficients with the same regressors share one factorisation; the groups stand as blocks on the diagonal of one
matrix, so that one call solves for all six coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.regression_signals import SignalLayout

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: F statistic of an instrument under which estimates that rest on it are not to be trusted.
STRONG = 25.0


@dataclass(frozen=True)
class ModelStructure:
    """Which regressors explain which coefficient. P unknowns, in blocks that share their regressors; C coefficients."""

    coefficients: tuple[str, ...]
    regressors: tuple[str, ...]  # of each unknown
    group: Index  # (P,) block of each unknown
    block: Index  # (C,) block of each coefficient
    same_block: Array  # (P, P) 1 where two unknowns belong to one block
    belongs: Array  # (P, C) 1 where the unknown belongs to the coefficient
    unit: Array  # (P, P) the unit matrix
    others: Array  # (P, P) 1 where two different unknowns belong to one block

    def unknowns(self, coefficient: int) -> Index:
        """Indices of a coefficient's unknowns."""
        return np.flatnonzero(self.group == self.block[coefficient])


def model_structure(regressors: dict[str, tuple[str, ...]]) -> ModelStructure:
    """Structure of a model, e.g. ``{"Cm": ("0", "alpha", "q", "de")}``; offsets are left out."""
    slopes = {c: tuple(r for r in rs if r != "0") for c, rs in regressors.items()}
    blocks = list(dict.fromkeys(slopes.values()))
    group = np.array([i for i, block in enumerate(blocks) for _ in block], dtype=np.intp)
    block = np.array([blocks.index(rs) for rs in slopes.values()], dtype=np.intp)
    same_block, unit = (group[:, None] == group).astype(float), np.eye(group.size)
    return ModelStructure(
        coefficients=tuple(slopes),
        regressors=tuple(r for block in blocks for r in block),
        group=group,
        block=block,
        same_block=same_block,
        belongs=(group[:, None] == block).astype(float),
        unit=unit,
        others=same_block - unit,
    )


@dataclass(frozen=True)
class GramEntries:
    """Flat indices into the W x W Gram matrix, and what is done with the entries there.

    They are transposed, so that LAPACK takes what is gathered as it lies.
    """

    normal: Index  # (2, P + C, P) of A'A above A'y, and of Z'A above Z'y
    counted: Array  # (2, P + C, P) 1 where the entry lies in a block, of A'y 2: see ``least_squares.solve``
    square: Index  # (C,) of y'y
    energy: Index  # (P,) of x'x
    sides: Index  # (P + C,) columns of the regressors, then of the coefficients
    known: Array  # (P + C, P) the unit matrix, and room for what is known

    @classmethod
    def of(cls, structure: ModelStructure, columns: Index, outputs: Index, instruments: Index, width: int) -> Self:
        """Those of a model; for the columns see ``NormalEquations``."""
        sides = np.concatenate([columns, outputs])
        return cls(
            normal=np.stack([sides[:, None] + rows * width for rows in (columns, instruments)]),
            counted=np.stack([np.vstack([structure.same_block, times * structure.belongs.T]) for times in (2.0, 1.0)]),
            square=outputs * (width + 1),
            energy=columns * (width + 1),
            sides=sides,
            known=np.eye(sides.size, columns.size),
        )


@dataclass(frozen=True)
class NormalEquations:
    """Which entries of the W x W Gram matrix make the normal equations. P unknowns (blocks), C coefficients."""

    structure: ModelStructure
    columns: Index  # (P,) column of each unknown's regressor
    outputs: Index  # (C,) column of each coefficient
    instruments: Index  # (P,) column of each unknown's instrument: its regressor, in least squares
    width: int  # W
    deflected: NDArray[np.bool_]  # (P,) whether the unknown's regressor is a control's deflection
    entries: GramEntries = field(init=False)
    instrumented: NDArray[np.bool_] = field(init=False)  # (C,) whether any of its regressors has an instrument
    least_squares: bool = field(init=False)  # whether every regressor is its own instrument
    variants: dict[tuple[int, ...], NormalEquations] = field(init=False, default_factory=dict, repr=False)  # kept

    def __post_init__(self) -> None:
        entries = GramEntries.of(self.structure, self.columns, self.outputs, self.instruments, self.width)
        replaced = self.columns != self.instruments
        object.__setattr__(self, "entries", entries)
        object.__setattr__(self, "instrumented", (self.structure.belongs.T @ replaced) > 0.0)
        object.__setattr__(self, "least_squares", not replaced.any())


def normal_equations(regressors: dict[str, tuple[str, ...]], layout: SignalLayout) -> NormalEquations:
    """Normal equations of a model (see ``model_structure``) with the signals of a layout; offsets come after."""
    structure = model_structure(regressors)
    columns = np.array([layout.column(r) for r in structure.regressors], dtype=np.intp)
    return NormalEquations(
        structure=structure,
        columns=columns,
        outputs=np.array([layout.column(c) for c in structure.coefficients], dtype=np.intp),
        instruments=np.array([layout.instrument(r) for r in structure.regressors], dtype=np.intp),
        width=layout.width,
        deflected=(columns >= layout.deflections.start) & (columns < layout.deflections.stop),
    )


def with_strong_instruments(full: NormalEquations, strength: Array) -> NormalEquations:
    """The equations, with least squares in blocks that have a weak instrument: a small bias beats a huge variance."""
    weak = full.structure.group[strength < STRONG].tolist()
    return with_least_squares_in(full, tuple(sorted(set(weak)))) if weak else full


def least_squares_of(full: NormalEquations) -> NormalEquations:
    """The equations of least squares: every regressor is its own instrument."""
    return with_least_squares_in(full, tuple(range(int(full.structure.group.max()) + 1)))


def with_least_squares_in(full: NormalEquations, blocks: tuple[int, ...]) -> NormalEquations:
    """The equations, with least squares in these blocks; made once and kept in ``variants``."""
    if blocks not in full.variants:
        chosen = np.isin(full.structure.group, blocks)
        full.variants[blocks] = replace(full, instruments=np.where(chosen, full.columns, full.instruments))
    return full.variants[blocks]
