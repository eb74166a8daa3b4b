"""The faults that are considered, as shifts of the reference derivatives.

Each fault keeps the equations linear. A surface that lost the share l of its effect loses l of its derivatives. A
surface that is stuck at an angle loses all of them, and the moments at that angle are added to the offsets. A vane with
an offset changes the offsets, too. A servo that becomes slower moves the shares of its lags. A wrong airspeed scales
all terms with dynamic pressure. Every surface and sensor has therefore a direction of its own in the space of all
terms, by which faults are distinguished. Damage is any shift of the derivatives of an axis. As a simpler hypothesis,
which needs less evidence, it is a change of stiffness, of damping, or of both, which a shifted mass or the loss of a
part of the tail causes first.

The shifts by vanes and airspeed are proportional to the error only where it is small: by 3 deg of the angle of attack
the drag coefficient of ``cdrw`` shifts by 0.008 otherwise than the tangent says. They are linearised anew about the
size that is found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS, LATERAL, LONGITUDINAL
from sysid_node.faults.hypotheses.bayes_factors import Shift
from sysid_node.faults.model.lagged_controls import LAGS
from sysid_node.faults.model.terms import RATES, Terms
from sysid_node.faults.types import AIRSPEED, DAMAGE, LOSS, SHIFTED, SLOWER, STUCK, VANE_OFFSET

Array = NDArray[np.float64]

#: Prior standard deviations: share of a surface's effect, angle of a surface (rad), share of a lag of a servo, share of
#: dynamic pressure, angle of a vane (rad), share of a derivative.
LOST, MOVED, SLOWED, PRESSURE, TURNED, CHANGED = 0.5, 0.1, 0.8, 0.5, 0.1, 0.5
_STEP = 1e-4  # of a size, by which a shift is differentiated
_LEAST_PRESSURE = 0.01  # times the measured dynamic pressure
LIMIT = 0.35  # rad, where the aircraft file gives no limit
_LIFT, _DRAG = COEFFICIENTS.index("CL"), COEFFICIENTS.index("CD")


@dataclass(frozen=True)
class Hypothesis:
    """A kind of fault of a part, and its shift of the derivatives."""

    kind: str
    part: str
    shift: Shift
    limit: float = 0.0  # rad, of a surface's travel
    whole: bool = False  # all derivatives of an axis, which can fit any change
    measure: tuple[float, ...] = (1.0,)  # the size by one of each free direction; damage has none
    one_sided: bool = False  # its size is never negative
    of_size: Callable[[float], Array] | None = None  # the shift (D,) by a size, where it is not proportional to it


def hypotheses(aircraft: Aircraft, terms: Terms, reference: Array, commanded: Collection[str] = ()) -> list[Hypothesis]:
    """All hypotheses for the reference values (D,). Controls that are ``commanded`` follow through a servo."""
    found = []
    for name, control in aircraft.controls.items():
        if terms.of(control.symbol).any():
            found += _of_surface(name, control.symbol, control.limit or LIMIT, terms, reference)
            if name in commanded:
                found.append(
                    Hypothesis(SLOWER, name, _slower(name, terms, reference.size), measure=LAGS, one_sided=True)
                )
    found.append(_curved(AIRSPEED, "airspeed", partial(_pressure, terms, reference), PRESSURE))
    for vane in ("alpha", "beta"):
        if terms.of(vane).any():
            found.append(_curved(VANE_OFFSET, vane, partial(_turned, vane, terms, reference), TURNED))
    for axis, names in _AXES:
        columns = _columns(names, terms)
        if columns.size:
            found.append(Hypothesis(DAMAGE, axis, _changed(columns, terms, reference), whole=True))
    for axis, those in _STIFFNESS:
        present = [[terms.names.index(name) for name in names] for names in those if set(names) <= set(terms.names)]
        found += [Hypothesis(DAMAGE, axis, _changed(np.array(columns), terms, reference)) for columns in present]
    return found


def linearised(hypothesis: Hypothesis, size: Array) -> Shift:
    """The shift by a hypothesis, linear about a size (m,) of its free directions."""
    if hypothesis.of_size is None:
        return hypothesis.shift
    return _tangent(hypothesis.of_size, float(size[0]), float(hypothesis.shift.spread[0]))


def _curved(kind: str, part: str, of_size: Callable[[float], Array], spread: float) -> Hypothesis:
    return Hypothesis(kind, part, _tangent(of_size, 0.0, spread), of_size=of_size)


def _tangent(of_size: Callable[[float], Array], size: float, spread: float) -> Shift:
    """The tangent of a shift at a size, with the prior standard deviation of the whole size."""
    slope = (of_size(size + _STEP) - of_size(size - _STEP)) / (2.0 * _STEP)
    return Shift(of_size(size) - size * slope, slope[:, None], np.array([spread]))


_AXES = (("longitudinal", LONGITUDINAL), ("lateral", LATERAL))
#: Stiffness and damping about each axis, alone and together.
_STIFFNESS = (
    ("longitudinal", (("Cm_alpha",), ("Cm_q",), ("Cm_alpha", "Cm_q"))),
    ("lateral", (("Cl_beta",), ("Cl_p",), ("Cl_beta", "Cl_p"), ("Cn_beta",), ("Cn_r",), ("Cn_beta", "Cn_r"))),
)


def _of_surface(name: str, symbol: str, limit: float, terms: Terms, reference: Array) -> list[Hypothesis]:
    lost = np.where(terms.of(symbol), -reference, 0.0)
    servo, _ = terms.servos[name]
    lost[servo] = -reference[servo]  # what the servo is behind by has lost its effect, too
    moved = _offsets(symbol, terms, reference)
    none = np.zeros_like(reference)
    return [
        Hypothesis(LOSS, name, _free([lost], [LOST]), limit),
        Hypothesis(STUCK, name, Shift(lost, moved[:, None], np.array([limit])), limit),
        Hypothesis(SHIFTED, name, Shift(none, moved[:, None], np.array([MOVED])), limit),
    ]


def _slower(name: str, terms: Terms, count: int) -> Shift:
    """The shift by a servo that is slower: the shares of its lags change, each by itself, as its order is not known."""
    servo, _ = terms.servos[name]
    return _free(list(np.eye(count)[servo]), [SLOWED] * servo.size)


def _offsets(regressor: str, terms: Terms, reference: Array) -> Array:
    """(D,) the change of the offsets by one radian of a regressor."""
    shift = np.zeros_like(reference)
    for d in np.flatnonzero(terms.of(regressor)).tolist():
        shift[terms.offset_of(terms.output[d])] += reference[d]
    return shift


def _pressure(terms: Terms, reference: Array, size: float) -> Array:
    """(D,) the shift where dynamic pressure is ``1 + size`` times the measured one.

    Non-dimensional rates change by its root.
    """
    times = max(1.0 + size, _LEAST_PRESSURE)
    share = np.array([math.sqrt(times) if r in RATES else times for r in terms.regressors])
    return np.asarray((share - 1.0) * reference)


def _turned(vane: str, terms: Terms, reference: Array, size: float) -> Array:
    """(D,) the shift where the true angle is ``size`` (rad) above the measured one.

    An alpha error also rotates lift and drag.
    """
    true = reference + size * _offsets(vane, terms, reference)
    seen = true.copy()
    if vane == "alpha":
        for output, other, sine in ((_LIFT, _DRAG, math.sin(size)), (_DRAG, _LIFT, -math.sin(size))):
            for d in np.flatnonzero(terms.output == output).tolist():
                twin = (terms.output == other) & (terms.column == terms.column[d])
                seen[d] = math.cos(size) * true[d] + sine * true[twin].sum()
    return np.asarray(seen - reference)


def _changed(columns: NDArray[np.intp], terms: Terms, reference: Array) -> Shift:
    """An independent change of each of these derivatives."""
    free = np.zeros((reference.size, columns.size))
    free[columns, np.arange(columns.size)] = 1.0
    spread = np.maximum(CHANGED * np.abs(reference[columns]), 2.0 * terms.tolerance[columns])
    return Shift(np.zeros_like(reference), free, spread)


def _columns(names: Sequence[str], terms: Terms) -> NDArray[np.intp]:
    """The terms of these coefficients."""
    return np.flatnonzero(np.isin(terms.output, [COEFFICIENTS.index(name) for name in names]))


def _free(columns: Sequence[Array], spread: Sequence[float]) -> Shift:
    free = np.column_stack(columns)
    return Shift(np.zeros(len(free)), free, np.array(spread))
