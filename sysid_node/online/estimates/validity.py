"""Whether an estimate is valid, and the reason where it is not.

Criteria that change only with renewals are evaluated once per renewal (``validity_basis``). Criteria that change with
every sample are evaluated for all estimates at once (``judge``). Statuses are numbers (see ``status``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.online import status
from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.estimates import roll_mode_exchange
from sysid_node.online.estimates.current_solution import CurrentSolution, slope_variances
from sysid_node.online.regression import damping, least_squares, normal_equations
from sysid_node.online.regression.gust_correlation import MOMENTS
from sysid_node.online.regression.least_squares import student_95
from sysid_node.online.regression.normal_equations import ModelStructure
from sysid_node.online.state import EstimatorState, SegmentSolution, ValidityBasis
from sysid_node.online.status import Codes

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

NORMAL_95 = 1.959963984540054  # standard errors of the normal distribution's two-sided 95 % interval
ENOUGH_FREEDOM = 5.0  # degrees of freedom under which an interval is not trusted
INDISTINGUISHABLE = 1e4  # variance inflation beyond which regressors cannot be told apart at all
COLLINEAR = 10.0  # ... beyond which collinearity is named as the reason for a wide interval
STALE = 0.5  # s without a new sample
SETTLING = 1.0  # s after an abrupt change in which "changed" is said
POOR = 0.7  # share of a coefficient's motion left unexplained beyond which no estimate of it is valid
NARROWEST = 1e-12  # share of an estimate under which its standard error is rounding
#: A servo is known poorly from this standard error of its lateness on, s.
POORLY_KNOWN = 0.02
#: Share of its value by which such a standard error may change a slope. Beyond it the change is not linear in the
#: lateness, as the slope's interval takes it to be.
LARGEST_CHANGE = 0.15
BURIED = 3.0  # times its sensor's noise energy that a regressor must move


def validity_basis(state: EstimatorState, latest: SegmentSolution) -> ValidityBasis:
    """What the judgement of all estimates rests on until the next renewal; weighed once."""
    latest.basis = latest.basis or _validity_basis(state, latest)
    return latest.basis


def _validity_basis(state: EstimatorState, latest: SegmentSolution) -> ValidityBasis:
    """Evaluate the criteria of ``validity_basis``."""
    table, equations, freedom = state.model.table, state.equations, latest.uncertainty.freedom
    c = table.coefficient
    start, _, stop = state.model.settings.frequencies
    # an equation with one weak instrument is solved by least squares, which gusts bias
    strengths = latest.instruments.strength.strength[:, None]
    strength = np.where(equations.structure.belongs > 0.0, strengths, np.inf).min(axis=0)
    swapped = roll_mode_exchange.exchanged(state, latest)
    objections, squares = _objections(state, latest, swapped), student_95(freedom)[c] ** 2
    factors = latest.instruments.selection_bias_factors
    cautions = np.where(table.offset, factors.max(axis=0)[c], factors[table.unknown, c])
    caution, longest = np.maximum(cautions, 1.0), latest.instruments.anderson_rubin.longest(squares)
    systematic = _systematic(state, latest)
    without_objection = objections == status.OK
    stds, samples = latest.uncertainty.residual_std(stop - start), round(latest.total.samples)
    return ValidityBasis(
        without_objection=(strength >= normal_equations.STRONG)[c] & without_objection,
        objections=objections,
        reasons=np.where(without_objection, np.uint8(status.CONVERGING), objections),
        open=without_objection,
        squares=squares,
        longest=longest,
        # what is allowed is counted with the systematic part, which no caution about chance concerns
        allowed=np.minimum((table.allowed**2 - systematic) / caution, longest),
        relative=table.relative**2 / caution if table.relative.any() else None,
        systematic=systematic,
        systematic_errors=np.sqrt(systematic),
        systematic_arms=NORMAL_95**2 * systematic,
        floor=np.maximum(BURIED * latest.total.bias.take(equations.entries.energy), least_squares.TINY),
        fits=np.stack([np.zeros_like(stds), stds, freedom, np.full_like(stds, samples)], axis=1),
        servos=_of_servos(state, latest, objections, swapped),
    )


def _of_servos(state: EstimatorState, latest: SegmentSolution, objections: Codes, swapped: bool) -> Codes:
    """(m,) the ``objections`` (D,) to the derivatives of a control where none is without: they hold for its servo too.

    A servo's time is told by the equations that the control is in. No time is told by a control whose effect may be
    nothing. That of the aileron may be ``swapped`` with the roll mode's.
    """
    imperfect, table, layout = state.model.imperfections, state.model.table, state.model.layout
    if imperfect is None:
        return np.zeros(0, np.uint8)
    regressors, found = np.array(state.equations.structure.regressors), np.zeros(imperfect.timed.size, np.uint8)
    felt = _felt(state, latest)
    for i, place in enumerate(imperfect.timed.tolist()):
        of_it = objections[(regressors[table.unknown] == layout.timed[place]) & ~table.offset]
        if of_it.size and (of_it != status.OK).all():
            found[i] = of_it[-1]
        if not felt[regressors == layout.timed[place]].any():
            found[i] = found[i] or status.CONVERGING
        if swapped and layout.timed[place] == roll_mode_exchange.CONTROL:
            found[i] = status.CONVERGING
    return found


def _felt(state: EstimatorState, latest: SegmentSolution) -> Flags:
    """(P,) whether the 95 % interval of some derivative with respect to a regressor does not hold zero.

    It must be a moment's derivative where there is one, because the moments tell the time of a control best.
    """
    solution, structure = latest.solution, state.equations.structure
    slopes, size = solution.theta.T, np.abs(solution.inverse.diagonal())
    variances = slope_variances(latest, solution.residual, size, 1.0)
    if latest.systematic is not None:
        slopes = slopes + latest.systematic.correction[:, :-1]
        variances = variances + latest.systematic.variance[:, :-1]
    belongs = structure.belongs.T > 0.0
    of_moments = belongs & np.isin(structure.coefficients, MOMENTS)[:, None]
    judged = np.where(of_moments.any(axis=0), of_moments, belongs)
    return np.asarray((judged & (np.abs(slopes) > NORMAL_95 * np.sqrt(np.maximum(variances, 0.0)))).any(axis=0))


def _systematic(state: EstimatorState, latest: SegmentSolution) -> Array:
    """(D,) squared systematic errors."""
    table, found = state.model.table, latest.systematic
    if found is None:
        return np.zeros(table.place.size)
    return np.maximum(found.variance.reshape(-1).take(table.place), 0.0)


def _objections(state: EstimatorState, latest: SegmentSolution, swapped: bool) -> Codes:
    """(D,) the status of each by the criteria that change with renewals; a later criterion takes precedence.

    ``swapped``: see ``roll_mode_exchange``.
    """
    table, words = state.model.table, state.model.vocabulary
    c = table.coefficient
    objections = np.zeros(c.size, np.uint8)
    objections[_moved_by_servos(state, latest)[c, table.unknown] & ~table.offset] = status.CONVERGING
    if swapped:
        rolling = state.equations.structure.coefficients.index(roll_mode_exchange.MOMENT)
        objections[(c == rolling) & ~table.offset] = status.CONVERGING
    lag = latest.tests.lag
    biased = lag.biased[table.unknown, c] & ~table.offset
    objections[biased] = [words.code(f"{lag.lagging_control[i]} not on time") for i in c[biased].tolist()]
    solved = state.equations.structure
    for symbol, axis in (*_felt_at_another_time(state, latest), *_motion_before_its_cause(state, latest)):
        objections[axis[c]] = words.code(f"{symbol} not on time")
    for symbol in _ahead_of_commands(state, latest):
        objections[_with_control(solved, symbol)[c] & ~table.offset] = words.code(f"{symbol} not on time")
    objections[latest.instruments.only_answered[c]] = words.code("surfaces answer gusts")
    objections[(latest.uncertainty.freedom < ENOUGH_FREEDOM)[c]] = status.CONVERGING
    if not state.inputs.thrust_known:
        objections[table.needs_thrust] = status.THRUST
    if state.flow.active:
        structure, at = state.model.aircraft.model_structure, state.segment.piece_start
        for i, name in enumerate(table.names):
            reason = flow_angle_filter.why_unknown(state.flow, at, name, structure[name.partition("_")[0]])
            objections[i] = words.code(reason) if reason else objections[i]
    objections[latest.tests.contradicted[c]] = status.CONTRADICTED
    objections[latest.tests.outside_model[c]] = status.OUTSIDE
    return objections


def _felt_at_another_time(state: EstimatorState, latest: SegmentSolution) -> list[tuple[str, Flags]]:
    """The controls on whose time all derivatives of a moment depend, and the coefficients (C,) that are wrong with it.

    When a deflection is felt is a property of the control, and the moment tells it best. Lift and drag, or the side
    force, have the same regressors and instruments; that their own equations do not show it makes them no better. A
    surface that only answers gusts is felt before it moves, for the gust that it answers is what is felt.
    """
    structure, lag = state.equations.structure, latest.tests.lag
    found, belongs = [], structure.belongs > 0.0
    for i, symbol in lag.lagging_control.items():
        if structure.coefficients[i] in MOMENTS and lag.biased[belongs[:, i], i].all():
            found.append((symbol, _with_control(structure, symbol) & (structure.block == structure.block[i])))
    return found


def _motion_before_its_cause(state: EstimatorState, latest: SegmentSolution) -> list[tuple[str, Flags]]:
    """The controls whose servos seem slower than the motion that follows them, and the coefficients of their axis."""
    structure, found = state.equations.structure, latest.systematic
    if found is None:
        return []
    return [
        (symbol, _with_control(structure, symbol) & (structure.block == structure.block[c]))
        for c, symbol in damping.amplified(structure, *latest.corrected(found)).items()
    ]


def _with_control(structure: ModelStructure, symbol: str) -> Flags:
    """(C,) coefficients among whose regressors a control is."""
    return np.asarray((structure.belongs[np.array(structure.regressors) == symbol] > 0.0).any(axis=0))


def _ahead_of_commands(state: EstimatorState, latest: SegmentSolution) -> tuple[str, ...]:
    """The controls whose surfaces would surely move before their commands."""
    imperfect, found = state.model.imperfections, latest.systematic
    if imperfect is None or found is None:
        return ()
    return tuple(state.model.layout.timed[i] for i in imperfect.timed[found.ahead(imperfect)].tolist())


def _moved_by_servos(state: EstimatorState, latest: SegmentSolution) -> Flags:
    """(C, P + 1) the slopes that a poorly known servo changes by more than ``LARGEST_CHANGE``.

    A servo and the roll mode, for example, may exchange their time constants. With an aileron's servo that seemed 90 ms
    faster than it was, the roll damping came out at a quarter of its value.
    """
    imperfect, found, theta = state.model.imperfections, latest.systematic, latest.solution.theta.T
    moved = np.zeros((theta.shape[0], theta.shape[1] + 1), bool)
    if imperfect is None or found is None:
        return moved
    slopes = np.abs(theta + found.correction[:, :-1])
    for i in np.flatnonzero(found.errors > POORLY_KNOWN).tolist():
        by = np.abs(found.considered.jacobian[imperfect.servos.start + i, :, :-1]) * found.errors[i]
        moved[:, :-1] |= by > LARGEST_CHANGE * slopes
    return moved


def judge(state: EstimatorState, latest: SegmentSolution, current: CurrentSolution, now: float) -> Codes:
    """(D,) statuses of the estimates ``current``, at ``now`` (s)."""
    table, equations, basis = state.model.table, state.equations, validity_basis(state, latest)
    motion = current.gram.reshape(-1).take(equations.entries.energy)
    inflation = current.size * motion
    below_noise = motion < basis.floor
    unidentifiable = below_noise | (inflation > INDISTINGUISHABLE)
    poor = _poor(current)
    good = _narrow(basis, current) & basis.without_objection
    if np.count_nonzero(unidentifiable):
        good &= ~(unidentifiable.take(table.unknown) & table.slope) & ~_with_unidentifiable_slope(state, unidentifiable)
    if np.count_nonzero(poor):
        good &= ~poor.take(table.coefficient)
    bad = ~good
    codes: Codes = bad * _reasons(state, basis, current, bad, inflation, below_noise, poor)
    if state.inputs.force.fault or state.inputs.contradiction:
        codes[:] = status.OUTSIDE
    _withhold_unchanging(state, codes)
    if current.time - state.changes.changed_at < SETTLING:
        codes[:] = status.CHANGED
    if now - current.time > STALE:
        codes[:] = status.STALE
    return codes


def _withhold_unchanging(state: EstimatorState, codes: Codes) -> None:
    """Set the statuses (D,) of estimates that depend on readings that stand still."""
    concerned = state.inputs.unchanging.coefficients
    if concerned is None:
        codes[:] = status.STALE
    elif concerned:
        codes[[name.partition("_")[0] in concerned for name in state.model.table.names]] = status.STALE


def _narrow(basis: ValidityBasis, current: CurrentSolution) -> Flags:
    """(D,) whether standard errors are small enough, and no rounding; and intervals have an end."""
    squares, allowed = current.values * current.values, basis.allowed
    if basis.relative is not None:
        allowed = np.maximum(allowed, np.minimum(basis.relative * squares - basis.systematic, basis.longest))
    narrow: Flags = current.variances <= allowed
    squares *= NARROWEST**2
    narrow &= current.variances > squares
    return narrow


def _poor(current: CurrentSolution) -> Flags:
    """(C,) whether the model leaves most of a coefficient's motion unexplained: its interval means nothing then."""
    residual, motion = current.solution.residual, current.solution.motion
    poor: Flags = residual > POOR * np.maximum(motion, least_squares.TINY)
    return poor


def _with_unidentifiable_slope(state: EstimatorState, unidentifiable: Flags) -> Flags:
    """(D,) offsets that hold what an unidentifiable slope (P,) of their coefficient does."""
    table = state.model.table
    return np.asarray(
        ((unidentifiable @ state.equations.structure.belongs) > 0.0).take(table.coefficient) & table.offset
    )


def _reasons(
    state: EstimatorState,
    basis: ValidityBasis,
    current: CurrentSolution,
    bad: Flags,
    inflation: Array,
    below_noise: Flags,
    poor: Flags,
) -> Codes:
    """(D,) what speaks against those that are ``bad`` (D,).

    ``inflation`` (P,) of its unknown's variance, a regressor's motion ``below_noise`` (P,), a ``poor`` (C,) fit.
    """
    if not current.solution.usable:
        return np.full_like(basis.reasons, status.NOT_EXCITED)
    table, asked = state.model.table, bad & basis.open
    if not np.count_nonzero(asked):
        return basis.reasons
    reasons, slopes = basis.reasons.copy(), asked & table.slope
    # what is found later counts more
    if np.count_nonzero(poor):
        reasons[poor.take(table.coefficient) & asked] = status.OUTSIDE
    collinear = (inflation.take(table.unknown) > COLLINEAR) & slopes
    if np.count_nonzero(collinear):
        partners = least_squares.most_correlated(state.equations, current.solution).take(table.unknown)
        reasons[collinear] = state.model.vocabulary.collinear + partners[collinear]
    if np.count_nonzero(below_noise):
        of_slope = below_noise.take(table.unknown) & slopes
        reasons[of_slope | (_with_unidentifiable_slope(state, below_noise) & asked)] = status.NOT_EXCITED
    return reasons
