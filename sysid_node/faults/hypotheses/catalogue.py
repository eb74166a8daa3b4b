"""What may have failed, as shifts of the derivatives that are held.

Every one of these leaves the equations linear: a surface that does the share 1 - l of its effect takes l of its
derivatives away; one that stands at an angle takes all of them away and puts the angle's moments into the offsets; a
vane that reads off, too, moves offsets; an airspeed that is wrong scales all that dynamic pressure multiplies. So every
surface and sensor has a direction of its own in the space of all coefficients' derivatives, and that tells them apart.
Damage is any shift of an axis's derivatives; and, as what explains less but asks for less proof, a share of the
stiffness about an axis, of the damping, or of both, which is what a shifted mass or a torn-off part of a tail does
first of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS, LATERAL, LONGITUDINAL
from sysid_node.faults.hypotheses.bayes_factors import Shift
from sysid_node.faults.model.terms import RATES, Terms
from sysid_node.faults.types import AIRSPEED, DAMAGE, LOSS, SHIFTED, STUCK, VANE_OFFSET

Array = NDArray[np.float64]

#: How large a fault may be, 1 sigma: share of a surface's effect, rad, share of dynamic pressure, rad, share of a
#: derivative.
LOST, MOVED, PRESSURE, TURNED, CHANGED = 0.5, 0.1, 0.5, 0.1, 0.5
LIMIT = 0.35  # rad, where the aircraft file gives no limit
_LIFT, _DRAG = COEFFICIENTS.index("CL"), COEFFICIENTS.index("CD")


@dataclass(frozen=True)
class Hypothesis:
    """A fault of a part."""

    kind: str
    part: str
    shift: Shift
    limit: float = 0.0  # rad, of a surface's travel
    whole: bool = False  # all derivatives of an axis, which can take up anything


def hypotheses(aircraft: Aircraft, terms: Terms, held: Array) -> list[Hypothesis]:
    """All faults about the held derivatives (D,)."""
    found = []
    for name, control in aircraft.controls.items():
        if terms.of(control.symbol).any():
            found += _of_surface(name, control.symbol, control.limit or LIMIT, terms, held)
    found.append(Hypothesis(AIRSPEED, "airspeed", _free([_pressure(terms, held)], [PRESSURE])))
    for vane in ("alpha", "beta"):
        if terms.of(vane).any():
            found.append(Hypothesis(VANE_OFFSET, vane, _free([_turned(vane, terms, held)], [TURNED])))
    for axis, names in _AXES:
        columns = _columns(names, terms)
        if columns.size:
            found.append(Hypothesis(DAMAGE, axis, _changed(columns, terms, held), whole=True))
    for axis, those in _STIFFNESS:
        present = [[terms.names.index(name) for name in names] for names in those if set(names) <= set(terms.names)]
        found += [Hypothesis(DAMAGE, axis, _changed(np.array(columns), terms, held)) for columns in present]
    return found


_AXES = (("longitudinal", LONGITUDINAL), ("lateral", LATERAL))
#: Stiffness and damping about each axis, alone and together.
_STIFFNESS = (
    ("longitudinal", (("Cm_alpha",), ("Cm_q",), ("Cm_alpha", "Cm_q"))),
    ("lateral", (("Cl_beta",), ("Cl_p",), ("Cl_beta", "Cl_p"), ("Cn_beta",), ("Cn_r",), ("Cn_beta", "Cn_r"))),
)


def _of_surface(name: str, symbol: str, limit: float, terms: Terms, held: Array) -> list[Hypothesis]:
    lost = np.where(terms.of(symbol), -held, 0.0)
    moved = _offsets(symbol, terms, held)
    none = np.zeros_like(held)
    return [
        Hypothesis(LOSS, name, _free([lost], [LOST]), limit),
        Hypothesis(STUCK, name, Shift(lost, moved[:, None], np.array([limit])), limit),
        Hypothesis(SHIFTED, name, Shift(none, moved[:, None], np.array([MOVED])), limit),
    ]


def _offsets(regressor: str, terms: Terms, held: Array) -> Array:
    """(D,) the offsets that a radian more of a regressor makes."""
    shift = np.zeros_like(held)
    for d in np.flatnonzero(terms.of(regressor)).tolist():
        shift[terms.offset_of(terms.output[d])] += held[d]
    return shift


def _pressure(terms: Terms, held: Array) -> Array:
    """(D,) of a dynamic pressure that is twice what is measured; non-dimensional rates go with its root."""
    share = np.array([0.5 if r in RATES else 1.0 for r in terms.regressors])
    return np.asarray(share * held)


def _turned(vane: str, terms: Terms, held: Array) -> Array:
    """(D,) of a true angle a radian above what is measured; all of lift and drag is turned by the angle of attack."""
    shift = _offsets(vane, terms, held)
    if vane == "alpha":
        for output, other, sign in ((_LIFT, _DRAG, 1.0), (_DRAG, _LIFT, -1.0)):
            for d in np.flatnonzero(terms.output == output).tolist():
                twin = (terms.output == other) & (terms.column == terms.column[d])
                shift[d] += sign * held[twin].sum()
    return shift


def _changed(columns: NDArray[np.intp], terms: Terms, held: Array) -> Shift:
    """Each of these derivatives by itself, of about the size that the others of its kind may change by."""
    free = np.zeros((held.size, columns.size))
    free[columns, np.arange(columns.size)] = 1.0
    spread = np.maximum(CHANGED * np.abs(held[columns]), 2.0 * terms.tolerance[columns])
    return Shift(np.zeros_like(held), free, spread)


def _columns(names: Sequence[str], terms: Terms) -> NDArray[np.intp]:
    """Terms of these coefficients."""
    return np.flatnonzero(np.isin(terms.output, [COEFFICIENTS.index(name) for name in names]))


def _free(columns: Sequence[Array], spread: Sequence[float]) -> Shift:
    free = np.column_stack(columns)
    return Shift(np.zeros(len(free)), free, np.array(spread))
