"""The gap by frequency: errors of forces, moments and kinematics on flight not fitted, beside their noise floor.

The error of a channel is the root of its residual's power, up to 4 Hz, over the power of its motion about the mean, in
the windows of ``residuals.windowed_spectra``. All channels count alike that moved and that commands excite.
Intervals are by a bootstrap over groups of windows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.predictive_density import Evidence, window_groups
from sysid_node.gap.instruments.overidentification import OveridentificationTest
from sysid_node.gap.residuals.excited_axes import excited_channels
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import Complex, power_of
from sysid_node.gap.thresholds import THRESHOLDS

#: Bootstrap draws.
_DRAWS = 2000

#: The errors of a gap, in order.
STAGES = ("before", "tolerances", "after", "noise_floor")

Interval = tuple[float, float]


@dataclass(frozen=True)
class Gap:
    """Root-mean-square errors as shares of the measured motion, overall and by channel, with 95 % intervals."""

    before: float
    tolerances: float  # with derivatives and biases fitted within their tolerances, without causes
    after: float
    noise_floor: float
    shrink_percent: float
    ci95: Interval  # of the shrinkage
    per_channel: dict[str, dict[str, float]]
    intervals: dict[str, Interval]  # of the four errors, by name


@dataclass(frozen=True)
class _Powers:
    """Powers by group of windows (G, 12): of the motion, of the sensors' noise, and of the errors (3, G, 12)."""

    measured: Array
    noise: Array
    errors: Array  # by the file, by the fitted derivatives, with the causes
    counted: NDArray[np.bool_]  # (12,) channels that moved, of a motion that the commands excite

    def table(self, structure: Array) -> Array:
        """Powers (4, G, 12) of the errors and of the noise floor, where a share (12,) of what is left is structure."""
        after = self.errors[2]
        floor = np.minimum(np.maximum(self.noise, after * (1.0 - structure)), self.errors.min(axis=0))
        return np.stack([*self.errors, floor])

    def overall(self, weight: Array, structure: Array) -> Array:
        """Overall errors (4,) at weights (G,) of the groups."""
        measured = np.maximum((self.measured * weight[:, None]).sum(axis=0), 1e-300)
        shares = (self.table(structure) * weight[:, None]).sum(axis=1) / measured
        return np.asarray(np.sqrt(shares[:, self.counted].mean(axis=1))) if self.counted.any() else np.zeros(4)

    def by_channel(self, structure: Array) -> dict[str, dict[str, float]]:
        """Errors by channel that moved, and by stage."""
        errors = np.sqrt(self.table(structure).sum(axis=1) / np.maximum(self.measured.sum(axis=0), 1e-300))
        columns = {name: errors[:, k].tolist() for k, name in enumerate(CHANNELS) if self.counted[k]}
        return {name: dict(zip(STAGES, column, strict=True)) for name, column in columns.items()}


def gap_of(base: Evidence, after: Evidence, left: OveridentificationTest) -> Gap:
    """The gap on flights not fitted: as the aircraft file, the fitted derivatives and the explanation predict them."""
    powers = _powers_of(base, after)
    structure, groups = np.clip(left.share, 0.0, 1.0), len(powers.measured)
    overall = powers.overall(np.ones(groups), structure)
    return gap_from(overall, _bootstrap(powers.overall, left, groups), powers.by_channel(structure))


def _powers_of(base: Evidence, after: Evidence) -> _Powers:
    """Powers of the flights of evidence without and with the causes."""
    models = [flight.model for flight in base.flights]
    groups = [(model, group) for model in models for group in window_groups(model)]
    measured = np.array([(np.abs(m.measured[g][:, 1:]) ** 2).sum(axis=(0, 1)) * m.axes for m, g in groups])
    noise = np.array([len(g) * (m.noise.sum(axis=0) - 0.5 * m.noise[0]) * m.axes for m, g in groups])
    before = [model.residual(model.simulator.neutral()) for model in models]
    fitted = ([flight.residual for flight in evidence.flights] for evidence in (base, after))
    errors = np.array([_powers(residuals, models) for residuals in (before, *fitted)])
    moved = measured.sum(axis=0) > THRESHOLDS.validation.motion * noise.sum(axis=0)
    known = np.all([model.axes for model in models], axis=0)  # as of short flights
    return _Powers(measured, noise, errors, known & moved & excited_channels(models))


def gap_from(overall: Array, draws: Array, channels: dict[str, dict[str, float]]) -> Gap:
    """The gap of the overall errors (4,), with bootstrap draws (D, 4) of them, and the errors by channel."""
    values = dict(zip(STAGES, overall.tolist(), strict=True))
    intervals = {name: interval(draws[:, k]) for k, name in enumerate(STAGES)}
    shrink = float(shrinkage(overall))
    return Gap(**values, shrink_percent=shrink, ci95=interval(shrinkage(draws)), per_channel=channels,
               intervals=intervals)  # fmt: skip


def within_tolerances(gap: Gap, fitted: Gap) -> Gap:
    """The gap with the smaller of two errors within tolerances: of the file's derivatives, and of fitted ones.

    ``gap`` is that of causes beside the file's derivatives, which are within their tolerances, too; ``fitted`` is that
    of derivatives fitted within them, without causes.
    """
    if fitted.tolerances >= gap.tolerances:
        return gap
    channels = {
        name: {**errors, "tolerances": fitted.per_channel.get(name, errors)["tolerances"]}
        for name, errors in gap.per_channel.items()
    }
    ends = {**gap.intervals, "tolerances": fitted.intervals["tolerances"]}
    return replace(gap, tolerances=fitted.tolerances, per_channel=channels, intervals=ends)


def interval(draws: Array) -> Interval:
    """Ends of the 95 % interval of draws (D,)."""
    low, high = np.percentile(draws, [2.5, 97.5]).tolist()
    return low, high


def _bootstrap(errors: Callable[[Array, Array], Array], left: OveridentificationTest, groups: int) -> Array:
    """Errors (D, 4) by a bootstrap over the groups; the share of structure is drawn within its standard deviation."""
    random = np.random.default_rng(0)
    draws = random.multinomial(groups, np.ones(groups) / groups, _DRAWS)
    shares = left.beyond + random.standard_normal((_DRAWS, left.chance.size)) * left.chance
    shares = np.clip(shares / np.maximum(left.total, 1e-300), 0.0, 1.0)
    return np.array([errors(d.astype(float), share) for d, share in zip(draws, shares, strict=True)])


def shrinkage(errors: Array) -> Array:
    """Shrinkage (...,) of errors (..., 4), in percent of what lies above the noise floor; 0 where nothing does."""
    before, _, after, floor = np.moveaxis(errors, -1, 0)
    room = before - floor
    open_ = room > 1e-9 * floor
    return np.asarray(np.where(open_, 100.0 * ((before - after) / np.where(open_, room, 1.0)), 0.0))


def _powers(residuals: Sequence[Complex], models: Sequence[ResidualModel]) -> Array:
    """Power (G, 12) of residuals by group of windows."""
    pairs = zip(residuals, models, strict=True)
    return np.array([power_of(residual[group]) for residual, model in pairs for group in window_groups(model)])
