"""Whether an explanation stands on flight that was not fitted, as pure functions of errors.

Errors (rms, as shares of the motion) are those of the aircraft file (``before``), of the derivatives fitted within
their tolerances (``tolerances``) and with the causes (``after``), by one or two measures: forces and kinematics by
frequency, then short simulated flights where these can be simulated.

A measure is the root mean square over channels, in which the worst channel counts most: nothing that mends the others
is seen beside one that no cause of the list mends. The geometric mean over channels is seen, too. Up to a
constant its logarithm is the negative log likelihood per sample and channel of white noise whose variance is unknown in
each channel (Klein & Morelli (2016), Aircraft System Identification, ch. 6).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds

#: Channels that compare the attitude with the integral of the gyroscopes' rates.
ATTITUDE = ("phi", "theta", "psi")


class Errors(Protocol):
    """Errors by one measure."""

    @property
    def before(self) -> float:
        """Of the aircraft file."""

    @property
    def tolerances(self) -> float:
        """Of the derivatives fitted within their tolerances."""

    @property
    def after(self) -> float:
        """With the causes."""

    @property
    def per_channel(self) -> Mapping[str, Mapping[str, float]]:
        """The same of each channel, by its name and by these names; empty of a single channel."""


class ErrorTable(NamedTuple):
    """Errors by one measure as plain values."""

    before: float
    tolerances: float
    after: float
    per_channel: Mapping[str, Mapping[str, float]] = MappingProxyType({})


def causes_stand(
    errors: Sequence[Errors],
    attitude: Sequence[Errors] = (),
    *,
    derivatives_plausible: bool = True,
    thresholds: Thresholds = THRESHOLDS,
) -> bool:
    """Whether causes predict better than the derivatives by at least one measure, and than the file by every one.

    They also do where they take away a fifth of the error by the geometric mean over channels. Where they take a
    large share of the file's away by one measure, they may tie with the file by another: one that does not see what
    they change. In gusts that is often the whole of either; ``attitude`` are the errors of the
    attitude by the gyroscopes, in which no gusts are. Where they take away much of the error of short flights, they may
    be worse by the other measure by as much as still halves the product of both errors, as fitted derivatives may.

    Derivatives that are implausible by their tolerances together (``derivatives_plausible`` is False) may predict a
    little better than a cause that makes them plausible again.
    """
    most = 1.0 if derivatives_plausible else thresholds.validation.implausible_derivatives
    limits = thresholds.validation
    seen = (*errors, *attitude)
    over_file = any(channel_ratio(e, e, "before", thresholds) < limits.large_improvement for e in errors)
    over_tolerances = any(channel_ratio(e, e, "tolerances", thresholds) < limits.mean_improvement for e in errors)
    large = over_file or any(e.after < limits.large_improvement * e.before for e in seen)
    worst = _worst(errors[-1].after, errors[-1].before, thresholds, otherwise=limits.tie if large else 1.0)
    better = over_tolerances or any(e.after < most * e.tolerances for e in seen)
    return better and all(e.after < worst * e.before for e in errors)


def channel_ratio(errors: Errors, others: Errors, stage: str = "after", thresholds: Thresholds = THRESHOLDS) -> float:
    """Geometric mean over channels of the ratio of the errors with causes to other errors at a stage, by one measure.

    Errors too small to be of interest count as if they were just of interest. One without common channels.
    """
    least = thresholds.acceptance.noticeable_error
    both = errors.per_channel.keys() & others.per_channel.keys()
    pairs = [(errors.per_channel[name]["after"], others.per_channel[name][stage]) for name in sorted(both)]
    logs = [math.log(max(left, least) / max(other, least)) for left, other in pairs]
    return math.exp(math.fsum(logs) / max(len(logs), 1))


def file_predicts_better(errors: Sequence[Errors], thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether the file predicts better than the fitted derivatives, by at least one measure.

    In gusts derivatives that these have biased may predict better by frequency. Where the fitted derivatives take away
    a large share of the error by the last measure, that of short flights, they may tie with the file by the other; and
    be worse by as much as still halves the product of both errors.
    """
    worst = _worst(errors[-1].tolerances, errors[-1].before, thresholds, otherwise=1.0)
    return any(e.tolerances > worst * e.before for e in errors)


def _worst(left: float, before: float, thresholds: Thresholds, *, otherwise: float) -> float:
    """Largest ratio to the file's error that is allowed by each measure, where the last one leaves an error.

    Where the last measure, that of short flights, takes a large share away: a tie, or what halves the product of both.
    """
    limits = thresholds.validation
    if not left < limits.large_improvement * before:
        return otherwise
    return max(limits.tie, limits.product * before / max(left, 1e-300))


def is_needless(with_it: Sequence[Errors], without: Sequence[Errors], thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether flight that was not fitted is predicted at least as well without a cause, by every measure.

    What a cause explains of the flights fitted, and of no other flight, is an error of the model there. By the
    geometric mean over channels the errors may tie. Where no short flight can be simulated without the cause, it is
    needed; where none can with it, it is judged by frequency alone.
    """
    pairs = list(zip(without, with_it, strict=False))
    ties = (channel_ratio(less, more, thresholds=thresholds) <= thresholds.validation.tie for less, more in pairs)
    return len(without) >= len(with_it) and all(less.after <= more.after for less, more in pairs) and all(ties)


def file_derivatives_suit_causes(
    with_file: Sequence[Errors],
    with_fitted: Sequence[Errors],
    *,
    clearly: bool = False,
    thresholds: Thresholds = THRESHOLDS,
) -> bool:
    """Whether causes predict better with the file's derivatives than with the fitted ones, by the last measure.

    ``clearly``: by more than a tie, which is asked for where without causes the fitted ones predict better. Where short
    flights can be simulated with one of the two alone, that one predicts better.
    """
    if len(with_file) != len(with_fitted):
        return len(with_file) > len(with_fitted)
    least = thresholds.validation.tie if clearly else 1.0
    return with_file[-1].after * least < with_fitted[-1].after


def shares_taken_away(readings: Mapping[str, Mapping[str, float]]) -> tuple[float, ...]:
    """Share of the error's power that the causes take away, by reading that moved, on flight not fitted.

    ``readings`` holds the errors of each (rms): ``before``, ``tolerances`` and ``after``.
    """
    pairs = ((min(e["before"], e["tolerances"]), e["after"]) for e in readings.values())
    return tuple(1.0 - (after / error) ** 2 if error > 0.0 else 0.0 for error, after in pairs)


def attitude_errors(
    channels: Mapping[str, Mapping[str, float]], thresholds: Thresholds = THRESHOLDS
) -> dict[str, ErrorTable]:
    """Of errors (rms) by channel those of the attitude by the gyroscopes that matter.

    What turns the aircraft turns both, so that no weather is in them.
    """
    least = thresholds.acceptance.noticeable_error
    shown = {name: channels[name] for name in ATTITUDE if name in channels}
    tables = {name: ErrorTable(e["before"], e["tolerances"], e["after"]) for name, e in shown.items()}
    return {name: table for name, table in tables.items() if table.before > least}


def causes_exceed_weather(taken: Sequence[float], thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether causes take away so much of some reading's error, on flight not fitted, that this was no weather.

    The noise floor is simulated in air that moves as the air data show. An instrument that is off moves them, too, and
    raises the floor by what it does. But what was fitted to one flight predicts no weather of another.
    """
    return max(taken, default=0.0) > thresholds.validation.beyond_weather


def weather_accounts_for(before: Array, floors: Array, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether weather and the sensors' noise account for the file's error in every reading.

    ``before`` (R,) are mean squares of the file's errors, ``floors`` (K, R) those that K simulated flights with nothing
    wrong leave in such air.
    """
    return bool((before <= thresholds.validation.chance**2 * np.mean(floors, axis=0)).all())
