"""From estimates to the gains that are flown: gates, margins over the corners of the intervals, bounded movement.

A derivative is used where its estimate is valid, its interval tight and its equation holds; the others stay as they are
flown. The regulator's gains for them are flown only if every corner of the used intervals is stable with margins; else
those of a more cautious regulator, and else what was flown before. The corners are looked at a few at every step, so
that no command is late for them. Gains and derivatives then move in a straight line, at a bounded rate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.control.axis import Axis
from sysid_node.control.margins import margins
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import IdentifiedDerivative

Array = NDArray[np.float64]

#: Corners of at most so many derivatives' intervals (those that move the motion most) are looked at, so many a step.
CORNERED, A_STEP = 8, 16

#: Weights on the surfaces that are tried in turn, in that of the baseline.
CAUTIONS = (1.0, 2.0, 4.0, 8.0, 16.0)

#: s between two checks of an axis.
PERIOD = 0.5

#: s of a lapse of estimates or sensors, after which what was flown before it is no longer taken up again.
LAPSE = 5.0

#: Surfaces that do less, in what the file's do (for two, the product), or the opposite, are not relied on.
LEAST_AUTHORITY = 0.1


class AxisParameters(NamedTuple):
    """What the law flies on: derivatives (D,) for the feedforward, gains (m, n) for the feedback."""

    values: Array
    gains: Array


@dataclass
class MarginCheck:
    """Gains under test: the corners (N, D) of the intervals, how many have passed, and with how much caution."""

    values: Array  # (D,)
    corners: Array
    gains: Array
    passed: int = 0
    caution: int = 0


@dataclass
class AxisAdaptation:
    """Of one axis."""

    axis: Axis
    flown: AxisParameters
    target: AxisParameters
    check: MarginCheck | None = None
    checked_at: float = -math.inf  # s
    used: tuple[str, ...] = ()  # derivatives whose estimates are in the target
    verdict: str = "baseline"
    accepted: int = 0
    refused: int = 0
    left: AxisParameters | None = None  # the target that was left for the baseline, to be taken up again
    left_at: float = math.nan  # s


def init(axis: Axis) -> AxisAdaptation:
    """Flying the baseline."""
    baseline = AxisParameters(axis.believed, axis.baseline)
    return AxisAdaptation(axis, baseline, baseline)


def fall_back(state: AxisAdaptation, why: str, now: float) -> None:
    """Head for the baseline at a time (s)."""
    if state.left is None:
        state.left, state.left_at = state.target, now
    state.check, state.verdict = None, f"baseline: {why}"
    state.target = AxisParameters(state.axis.believed, state.axis.baseline)


def resume(state: AxisAdaptation, now: float) -> None:
    """All is well again: head for what was flown before, if that is not long ago; it has passed its check."""
    if state.left is None:
        return
    if abs(now - state.left_at) <= LAPSE:
        state.target, state.verdict = state.left, "adapted before; taken up again" if state.accepted else "baseline"
    else:
        state.used, state.verdict = (), "baseline: no estimates fit for use since"
    state.left = None


def consider(
    state: AxisAdaptation, beliefs: Mapping[str, IdentifiedDerivative], settings: ControllerSettings, now: float
) -> None:
    """Begin the check of what new estimates ask for, if none is under way and the last is long enough ago."""
    if state.check is not None or abs(now - state.checked_at) < PERIOD:
        return
    values, half, used = state.target.values.copy(), np.zeros(len(state.axis.derivatives)), []
    for i, name in enumerate(state.axis.derivatives):
        belief = beliefs.get(name)
        if belief is not None and _usable(belief, settings.tightness * state.axis.sizes[i], settings.explained):
            values[i], half[i] = belief.value, 0.5 * (belief.upper - belief.lower)
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
    state.check, state.checked_at = MarginCheck(values, interval_corners(state.axis, values, half), gains), now
    state.used = tuple(used)


def advance(state: AxisAdaptation, settings: ControllerSettings, step: float) -> None:
    """Look at some corners, and move for ``step`` (s) towards the target."""
    if state.check is not None:
        _look(state, state.check, settings)
    state.flown = _moved(state.axis, state.flown, state.target, settings.gain_rate * step)


def _usable(belief: IdentifiedDerivative, half: float, explained: float) -> bool:
    """Whether an estimate may be used; NaN never is.

    In a closed loop an estimate is biased by the share of the surfaces' motion that answers to disturbances (Ljung,
    "System Identification", 2nd ed. (1999), sect. 13.4), which its interval does not know of: hence ``explained``.
    """
    tight = math.isfinite(belief.value) and 0.5 * (belief.upper - belief.lower) <= half
    return belief.valid and tight and belief.explained >= explained


def interval_corners(axis: Axis, values: Array, half: Array) -> Array:
    """(N, D) the corners of the intervals that matter most, each other derivative at its value."""
    widest = np.argsort(-half * axis.signals)[:CORNERED]
    chosen = widest[half[widest] > 0.0]
    signs = np.array(list(product((-1.0, 1.0), repeat=chosen.size)))
    corners = np.tile(values, (len(signs), 1))
    corners[:, chosen] += signs * half[chosen]
    return np.vstack([values, corners])


def _look(state: AxisAdaptation, check: MarginCheck, settings: ControllerSettings) -> None:
    """The next few corners with the gains under test."""
    corners = check.corners[check.passed : check.passed + A_STEP]
    if not _have_margins(state.axis, corners, check.gains, settings):
        _be_more_cautious(state, check)
        return
    check.passed += len(corners)
    if check.passed == len(check.corners):
        state.target, state.check = AxisParameters(check.values, check.gains), None
        state.accepted += 1
        caution = CAUTIONS[check.caution]
        state.verdict = "adapted" if caution == 1.0 else f"adapted, caution {caution:g}"


def _have_margins(axis: Axis, corners: Array, gains: Array, settings: ControllerSettings) -> bool:
    if not np.isfinite(gains).all():
        return False
    found = margins(axis.model(corners), gains, axis.delay)
    return bool(found.enough(settings.gain_margin, settings.phase_margin).all())


def _be_more_cautious(state: AxisAdaptation, check: MarginCheck) -> None:
    check.caution, check.passed = check.caution + 1, 0
    if check.caution == len(CAUTIONS):
        state.check, state.refused, state.verdict = None, state.refused + 1, "kept: no margins at the corners"
        return
    check.gains = _gains(state.axis, check.values, CAUTIONS[check.caution])


def _gains(axis: Axis, values: Array, caution: float) -> Array:
    """The regulator's gains, NaN where there are none: those have no margins."""
    try:
        return axis.gains(values, caution)
    except np.linalg.LinAlgError:
        return np.full(axis.baseline.shape, np.nan)


def _same_sense(axis: Axis, gains: Array) -> bool:
    """Whether the integral acts as the baseline's does; NaN gains fail their margins anyway.

    Its gain has the sign of what a steady deflection does in the end, to a climb or a turn: where that is turned round
    an estimate is wrong by more than its interval, and on the way from one sign to the other there is no feedback.
    """
    return not float(gains[:, axis.integral] @ axis.baseline[:, axis.integral]) <= 0.0


def _between(start: AxisParameters, end: AxisParameters, share: float) -> AxisParameters:
    return AxisParameters(*(a + share * (b - a) for a, b in zip(start, end, strict=True)))


def _moved(axis: Axis, flown: AxisParameters, target: AxisParameters, most: float) -> AxisParameters:
    """Towards the target by at most ``most`` of the baseline's gains, or of a derivative's size."""
    size = np.abs(axis.baseline).max(axis=0)  # (n,) by what each state is fed back
    gains = np.abs(target.gains - flown.gains).max(axis=0) / np.maximum(size, 0.1 * size.max())
    length = max(float(np.max(np.abs(target.values - flown.values) / axis.sizes)), float(gains.max()))
    return target if length <= most else _between(flown, target, most / length)
