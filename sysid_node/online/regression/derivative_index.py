"""Which entry of the solution each derivative of the aircraft file is, and what its error is measured against."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.regression.normal_equations import ModelStructure


@dataclass(frozen=True)
class DerivativeIndex:
    """Over the D derivatives whose equations can be formed, in the aircraft file's order."""

    names: tuple[str, ...]
    coefficient: NDArray[np.intp]  # (D,) index into the normal equations' coefficients
    unknown: NDArray[np.intp]  # (D,) index into the normal equations' unknowns; 0 for an offset
    offset: NDArray[np.bool_]  # (D,) whether it is a C_0
    place: NDArray[np.intp]  # (D,) index in (C, P + 1): the coefficients' slopes and, behind them, offsets
    allowed: NDArray[np.float64]  # (D,) the largest standard error of a valid estimate
    relative: NDArray[
        np.float64
    ]  # (D,) ... and its largest share of the estimate, where nothing is believed of the size
    needs_thrust: NDArray[np.bool_]  # (D,) meaningless without a measured thrust
    unformed: tuple[str, ...]  # derivatives whose equation cannot be formed

    @cached_property
    def slope(self) -> NDArray[np.bool_]:
        """(D,) whether it is no C_0."""
        return ~self.offset

    @cached_property
    def all_names(self) -> tuple[str, ...]:
        """Of the D derivatives, and behind them of those whose equation cannot be formed."""
        return self.names + self.unformed


def derivative_index(aircraft: Aircraft, structure: ModelStructure, valid_fraction: float) -> DerivativeIndex:
    """The aircraft's derivatives in the solution of a model of this ``structure``.

    A standard error is measured against the believed size of a derivative, or twice its tolerance where that is more:
    not against the estimate, which would call the large ones of many chance values valid. An estimate is valid with a
    standard error under ``valid_fraction`` of that.
    """
    names, coefficients, unknowns, offsets, sizes, unformed = [], [], [], [], [], []
    for name, belief in aircraft.derivatives.items():
        of, _, regressor = name.partition("_")
        if of not in structure.coefficients:
            unformed.append(name)
            continue
        c = structure.coefficients.index(of)
        names.append(name)
        coefficients.append(c)
        offsets.append(regressor == "0")
        unknowns.append(next((int(i) for i in structure.unknowns(c) if structure.regressors[i] == regressor), 0))
        sizes.append(max(abs(belief.value), 2.0 * (belief.tolerance or 0.0)))
    coefficient, unknown, offset = np.array(coefficients, np.intp), np.array(unknowns, np.intp), np.array(offsets)
    P = len(structure.regressors)
    return DerivativeIndex(
        names=tuple(names),
        coefficient=coefficient,
        unknown=unknown,
        offset=offset,
        place=coefficient * (P + 1) + np.where(offset, P, unknown),
        allowed=valid_fraction * np.array(sizes),
        relative=np.where(np.array(sizes) > 0.0, 0.0, valid_fraction),
        needs_thrust=np.array([name in ("CL_0", "CD_0") for name in names]),
        unformed=tuple(unformed),
    )
