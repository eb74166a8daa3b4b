"""Adapts the gains of an axis to new estimates, within gain and phase margins and at a bounded rate.

An estimate is used where it is valid, its interval is narrow and R^2 of its equation is large; the other derivatives
keep their values. The new gains are flown only if the loop keeps margins, and farther away stability, wherever the used
estimates may be (``confidence_region``). Otherwise gains of a regulator with a larger weight on the surfaces are tried,
and else the old gains are kept. A few points are checked at each step, so that no command is delayed. Gains and
derivatives then move to the new values on a straight line at a bounded rate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.control.design.axis import ControlAxis
from sysid_node.control.design.confidence_region import RegionPoints, region_points
from sysid_node.control.design.margins import margins, stable
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import ErrorCorrelation, IdentifiedDerivative

Array = NDArray[np.float64]

#: Points of the confidence region that are checked in a step.
A_STEP = 16

#: Weights on the surfaces that are tried in turn, relative to the baseline's.
CAUTIONS = (1.0, 2.0, 4.0, 8.0, 16.0)

#: s between two checks of an axis.
PERIOD = 0.5

#: s without estimates or sensors, after which the parameters flown before are not flown again.
LAPSE = 5.0

#: s in which the baseline is reached once it must be flown.
FALL = 0.1

#: Least effect of the surfaces relative to the file's (for two, the determinant); estimates with less are not used.
LEAST_AUTHORITY = 0.1


class AxisParameters(NamedTuple):
    """The parameters of the control law: derivatives (D,) for the feedforward, gains (m, n) for the feedback."""

    values: Array
    gains: Array


@dataclass
class MarginCheck:
    """Gains that are being checked at the points of the confidence region, ``passed`` of which are done."""

    values: Array  # (D,)
    points: RegionPoints
    gains: Array
    passed: int = 0
    caution: int = 0  # place in ``CAUTIONS``


@dataclass
class AxisAdaptation:
    """The state of the adaptation of one axis."""

    axis: ControlAxis
    flown: AxisParameters
    target: AxisParameters
    check: MarginCheck | None = None
    checked_at: float = -math.inf  # s
    used: tuple[str, ...] = ()  # derivatives of the target that are estimates
    verdict: str = "baseline"
    accepted: int = 0
    refused: int = 0
    left: AxisParameters | None = None  # the target before the baseline, to which it may return
    left_at: float = math.nan  # s
    fall_rate: float = 0.0  # 1/s, of the move to the baseline


def init(axis: ControlAxis) -> AxisAdaptation:
    """An axis that flies the baseline."""
    baseline = AxisParameters(axis.believed, axis.baseline)
    return AxisAdaptation(axis, baseline, baseline)


def fall_back(state: AxisAdaptation, why: str, now: float) -> None:
    """Make the baseline the target, at a time (s)."""
    baseline = AxisParameters(state.axis.believed, state.axis.baseline)
    if state.left is None:
        state.left, state.left_at = state.target, now
        state.fall_rate = _distance(state.axis, state.flown, baseline) / FALL
    state.check, state.verdict = None, f"baseline: {why}"
    state.target = baseline


def resume(state: AxisAdaptation, now: float) -> None:
    """Return to the target before the baseline, which has passed its check, unless that was too long ago."""
    if state.left is None:
        return
    if abs(now - state.left_at) <= LAPSE:
        state.target, state.verdict = state.left, "adapted before; taken up again" if state.accepted else "baseline"
    else:
        state.used, state.verdict = (), "baseline: no estimates fit for use since"
    state.left = None


def forget(state: AxisAdaptation) -> None:
    """Do not return to the target before the baseline: gains are adapted by new estimates only."""
    state.used, state.left_at = (), -math.inf


def consider(
    state: AxisAdaptation,
    estimates: Mapping[str, IdentifiedDerivative],
    settings: ControllerSettings,
    now: float,
    correlation: ErrorCorrelation | None = None,
) -> None:
    """Begin to check gains for new estimates, if no check is under way and the last one is long enough ago.

    Without the ``correlation`` of the estimates' errors, all corners of their intervals are checked.
    """
    if state.check is not None or abs(now - state.checked_at) < PERIOD:
        return
    values, half, used = state.target.values.copy(), np.zeros(len(state.axis.derivatives)), []
    for i, name in enumerate(state.axis.derivatives):
        estimate = estimates.get(name)
        if estimate is not None and _usable(estimate, settings.tightness * state.axis.sizes[i], settings.explained):
            values[i], half[i] = estimate.value, 0.5 * (estimate.upper - estimate.lower)
            used.append(name)
    if not used:
        return
    if np.linalg.det(state.axis.authority(values)) < LEAST_AUTHORITY:
        state.verdict = "kept: hardly any effect of the surfaces"
        return
    gains = _gains(state.axis, values, CAUTIONS[0])
    if not _same_sense(state.axis, gains):
        state.verdict = "kept: a steady deflection would do the opposite"
        return
    region = region_points(values, half, state.axis.signals, _among(state.axis, used, correlation))
    state.check, state.checked_at = MarginCheck(values, region, gains), now
    state.used = tuple(used)


def advance(state: AxisAdaptation, settings: ControllerSettings, step: float) -> None:
    """Check some points, and move the parameters towards the target for ``step`` (s): fast where it is a fall-back."""
    if state.check is not None:
        _check_points(state, state.check, settings)
    rate = settings.gain_rate if state.left is None else max(settings.gain_rate, state.fall_rate)
    state.flown = _moved(state.axis, state.flown, state.target, rate * step)


def _usable(estimate: IdentifiedDerivative, half: float, explained: float) -> bool:
    """Whether an estimate may be used; NaN never may.

    In closed loop an estimate is biased by the part of the surfaces' motion that responds to disturbances (Ljung,
    "System Identification", 2nd ed. (1999), sect. 13.4). Its interval does not include this bias, so that a least R^2,
    ``explained``, is required.
    """
    tight = math.isfinite(estimate.value) and 0.5 * (estimate.upper - estimate.lower) <= half
    return estimate.valid and tight and estimate.r_squared >= explained


def _among(axis: ControlAxis, used: Sequence[str], correlation: ErrorCorrelation | None) -> Array | None:
    """(D, D) correlation of the errors of the axis's derivatives, of which those not ``used`` have none; or None."""
    known = None if correlation is None else correlation.of(used)
    if known is None:
        return None
    places = [axis.derivatives.index(name) for name in used]
    found = np.eye(len(axis.derivatives))
    found[np.ix_(places, places)] = known
    return found


def _check_points(state: AxisAdaptation, check: MarginCheck, settings: ControllerSettings) -> None:
    """Check the next few points."""
    near = check.passed < check.points.margins
    end = min(check.passed + A_STEP, check.points.margins if near else len(check.points))
    points = check.points.values[check.passed : end]
    if not (_have_margins if near else _are_stable)(state.axis, points, check.gains, settings):
        _raise_caution(state, check)
        return
    check.passed = end
    if check.passed == len(check.points):
        state.target, state.check = AxisParameters(check.values, check.gains), None
        state.accepted += 1
        caution = CAUTIONS[check.caution]
        state.verdict = "adapted" if caution == 1.0 else f"adapted, caution {caution:g}"


def _have_margins(axis: ControlAxis, points: Array, gains: Array, settings: ControllerSettings) -> bool:
    if not np.isfinite(gains).all():
        return False
    found = margins(axis.model(points), gains, axis.delay)
    return bool(found.enough(settings.gain_margin, settings.phase_margin).all())


def _are_stable(axis: ControlAxis, points: Array, gains: Array, _: ControllerSettings) -> bool:
    return bool(stable(axis.model(points), gains, axis.delay).all())


def _raise_caution(state: AxisAdaptation, check: MarginCheck) -> None:
    check.caution, check.passed = check.caution + 1, 0
    if check.caution == len(CAUTIONS):
        state.check, state.refused, state.verdict = None, state.refused + 1, "kept: no margins within the intervals"
        return
    check.gains = _gains(state.axis, check.values, CAUTIONS[check.caution])


def _gains(axis: ControlAxis, values: Array, caution: float) -> Array:
    """The regulator's gains; NaN, which fails the check of margins, where it has none."""
    try:
        return axis.gains(values, caution)
    except np.linalg.LinAlgError:
        return np.full(axis.baseline.shape, np.nan)


def _same_sense(axis: ControlAxis, gains: Array) -> bool:
    """Whether the integral acts in the direction of the baseline's; NaN gains fail the check of margins anyway.

    The sign of its gain is that of the steady response to a deflection, a climb or a turn. Where it is reversed, an
    estimate is wrong by more than its interval, and on the way from one sign to the other there is no feedback.
    """
    return not float(gains[:, axis.integral] @ axis.baseline[:, axis.integral]) <= 0.0


def _between(start: AxisParameters, end: AxisParameters, share: float) -> AxisParameters:
    return AxisParameters(*(a + share * (b - a) for a, b in zip(start, end, strict=True)))


def _distance(axis: ControlAxis, start: AxisParameters, end: AxisParameters) -> float:
    """The length of the way between two parameters, relative to the baseline's gains and the derivatives' sizes."""
    size = np.abs(axis.baseline).max(axis=0)  # (n,) the largest gain of each state
    gains = np.abs(end.gains - start.gains).max(axis=0) / np.maximum(size, 0.1 * size.max())
    return max(float(np.max(np.abs(end.values - start.values) / axis.sizes)), float(gains.max()))


def _moved(axis: ControlAxis, flown: AxisParameters, target: AxisParameters, most: float) -> AxisParameters:
    """The parameters after a move to the target by at most ``most``; see ``_distance``."""
    length = _distance(axis, flown, target)
    return target if length <= most else _between(flown, target, most / length)
