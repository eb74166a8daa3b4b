"""How far the gap shrinks: the simulator's error on flight not fitted, before and after, beside what noise leaves.

The error of a channel is the root of its residual's power, up to 4 Hz, over the power of its motion about the mean, in
windows of ``spectra.LENGTH`` seconds; all channels that were moved count alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.predictive_density import Evidence, window_groups
from sysid_node.gap.instruments.overidentification import OveridentificationTest
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import Complex, power_of
from sysid_node.gap.thresholds import THRESHOLDS

_DRAWS = 2000


#: The errors of a gap, in order.
STAGES = ("before", "tolerances", "after", "noise_floor")

Interval = tuple[float, float]


@dataclass(frozen=True)
class Gap:
    """Root-mean-square errors as shares of what was measured, overall and by channel, with 95 % intervals."""

    before: float
    tolerances: float  # with derivatives and biases fitted within their tolerances, no effect
    after: float
    noise_floor: float
    shrink_percent: float
    ci95: Interval  # of the shrinkage
    per_channel: dict[str, dict[str, float]]
    intervals: dict[str, Interval]  # of the four errors, by name


def gap_of(base: Evidence, after: Evidence, left: OveridentificationTest) -> Gap:
    """The gap on flights not fitted: as the aircraft file, the fitted derivatives and the explanation predict them."""
    models = [flight.model for flight in base.flights]
    groups = [(model, group) for model in models for group in window_groups(model)]
    measured = np.array([(np.abs(model.measured[g][:, 1:]) ** 2).sum(axis=(0, 1)) for model, g in groups])
    noise = np.array([len(g) * (model.noise.sum(axis=0) - 0.5 * model.noise[0]) for model, g in groups])
    before = [model.residual(model.simulator.neutral()) for model in models]
    fitted = ([flight.residual for flight in evidence.flights] for evidence in (base, after))
    stages = [_powers(residuals, models) for residuals in (before, *fitted)]
    counted = models[0].axes & (measured.sum(axis=0) > THRESHOLDS.validation.motion * noise.sum(axis=0))

    def errors(weight: Array, share: Array) -> Array:
        """Overall errors (4,) at weights (G,) of the groups, where such a share (12,) of the remainder is structure."""
        floor = np.minimum(np.maximum(noise, stages[2] * (1.0 - share)), np.minimum(stages[0], stages[1]))
        table = np.stack([*stages, floor])  # (4, groups, 12)
        shares = (table * weight[:, None]).sum(axis=1) / np.maximum((measured * weight[:, None]).sum(axis=0), 1e-300)
        return np.asarray(np.sqrt(shares[:, counted].mean(axis=1))) if counted.any() else np.zeros(4)

    all_equal, structured = np.ones(len(groups)), np.clip(left.share, 0.0, 1.0)
    overall = errors(all_equal, structured)
    drawn = _bootstrap(errors, left, len(groups))
    floor = np.minimum(np.maximum(noise, stages[2] * (1.0 - structured)), np.minimum(stages[0], stages[1]))
    table = np.stack([*stages, floor])
    own = np.sqrt(table.sum(axis=1) / np.maximum(measured.sum(axis=0), 1e-300))
    channels = {c: dict(zip(STAGES, own[:, k].tolist(), strict=True)) for k, c in enumerate(CHANNELS) if counted[k]}
    return gap_from(overall, drawn, channels)


def gap_from(overall: Array, drawn: Array, channels: dict[str, dict[str, float]]) -> Gap:
    """Of the errors (4,), draws (D, 4) of these, and those of each channel."""
    values = dict(zip(STAGES, overall.tolist(), strict=True))
    intervals = {name: interval(drawn[:, k]) for k, name in enumerate(STAGES)}
    shrink = float(shrinkage(overall))
    return Gap(**values, shrink_percent=shrink, ci95=interval(shrinkage(drawn)), per_channel=channels,
               intervals=intervals)  # fmt: skip


def interval(drawn: Array) -> Interval:
    """95 % of draws (D,)."""
    low, high = np.percentile(drawn, [2.5, 97.5]).tolist()
    return low, high


def _bootstrap(errors: Callable[[Array, Array], Array], left: OveridentificationTest, groups: int) -> Array:
    """Errors (D, 4) in bootstraps of the groups, the structure left as uncertain as chance makes it."""
    random = np.random.default_rng(0)
    draws = random.multinomial(groups, np.ones(groups) / groups, _DRAWS)
    shares = left.beyond + random.standard_normal((_DRAWS, left.chance.size)) * left.chance
    shares = np.clip(shares / np.maximum(left.total, 1e-300), 0.0, 1.0)
    return np.array([errors(d.astype(float), share) for d, share in zip(draws, shares, strict=True)])


def shrinkage(errors: Array) -> Array:
    """Percent (...,) of what could be closed that is, of errors (..., 4).

    Nothing could where the gap is not above the floor.
    """
    before, _, after, floor = np.moveaxis(errors, -1, 0)
    room = before - floor
    open_ = room > 1e-9 * floor
    return np.asarray(np.where(open_, 100.0 * ((before - after) / np.where(open_, room, 1.0)), 0.0))


def _powers(residuals: Sequence[Complex], models: Sequence[ResidualModel]) -> Array:
    """Power (G, 12) of residuals by group of windows."""
    pairs = zip(residuals, models, strict=True)
    return np.array([power_of(residual[group]) for residual, model in pairs for group in window_groups(model)])
