"""How far the gap shrinks: the simulator's error on flight not fitted, before and after, beside what noise leaves.

The error of a channel is the root of its residual's power, up to 4 Hz, over the power of its motion about the mean, in
windows of ``spectra.LENGTH`` seconds; all channels that were moved count alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.evidence import Evidence, groups_of
from sysid_node.gap.spectra import Complex, power_of
from sysid_node.gap.structure import Structure
from sysid_node.gap.view import CHANNELS, View

#: A channel counts where its own power is so many times the sensors' noise.
_MOVED = 4.0

_DRAWS = 2000


@dataclass(frozen=True)
class Gap:
    """Root-mean-square errors as shares of what was measured, overall and by channel."""

    before: float
    tolerances: float  # with derivatives and biases fitted within their tolerances, no effect
    after: float
    noise_floor: float
    shrink_percent: float
    ci95: tuple[float, float]
    per_channel: dict[str, dict[str, float]]


def gap_of(views: Sequence[View], before: Sequence[Complex], base: Evidence, after: Evidence, left: Structure) -> Gap:
    """The gap on flights not fitted, from their residuals (W, L, 12) as the file has it, then as fitted."""
    groups = [(i, group) for i, view in enumerate(views) for group in groups_of(view)]
    measured = np.array([(np.abs(views[i].measured[g][:, 1:]) ** 2).sum(axis=(0, 1)) for i, g in groups])
    noise = np.array([len(g) * (views[i].noise.sum(axis=0) - 0.5 * views[i].noise[0]) for i, g in groups])
    stages = [_powers(r, groups) for r in (before, base.residuals, after.residuals)]
    counted = views[0].axes & (measured.sum(axis=0) > _MOVED * noise.sum(axis=0))

    def errors(weight: Array, share: Array) -> Array:
        """Overall errors (4,) at weights (G,) of the groups, where such a share (12,) of the remainder is structure."""
        floor = np.minimum(np.maximum(noise, stages[2] * (1.0 - share)), np.minimum(stages[0], stages[1]))
        table = np.stack([*stages, floor])  # (4, groups, 12)
        shares = (table * weight[:, None]).sum(axis=1) / np.maximum((measured * weight[:, None]).sum(axis=0), 1e-300)
        return np.asarray(np.sqrt(shares[:, counted].mean(axis=1))) if counted.any() else np.zeros(4)

    all_equal, structured = np.ones(len(groups)), np.clip(left.share, 0.0, 1.0)
    overall = errors(all_equal, structured)
    shrinks = _shrinks(errors, left, len(groups))
    floor = np.minimum(np.maximum(noise, stages[2] * (1.0 - structured)), np.minimum(stages[0], stages[1]))
    table = np.stack([*stages, floor])
    own = np.sqrt(table.sum(axis=1) / np.maximum(measured.sum(axis=0), 1e-300))
    names = ("before", "tolerances", "after", "noise_floor")
    channels = {c: dict(zip(names, own[:, k].tolist(), strict=True)) for k, c in enumerate(CHANNELS) if counted[k]}
    low, high = np.percentile(shrinks, [2.5, 97.5]).tolist()
    before_, fitted, after_, floor_ = overall.tolist()
    return Gap(before_, fitted, after_, floor_, _shrink(overall), (low, high), channels)


def _shrinks(errors: Callable[[Array, Array], Array], left: Structure, groups: int) -> list[float]:
    """Shrinkage in bootstraps of the groups, the structure left as uncertain as chance makes it."""
    random = np.random.default_rng(0)
    draws = random.multinomial(groups, np.ones(groups) / groups, _DRAWS)
    shares = (left.deviations + random.standard_normal((_DRAWS, left.chance.size))) * left.chance
    shares = np.clip(shares / np.maximum(left.total, 1e-300), 0.0, 1.0)
    return [_shrink(errors(d.astype(float), share)) for d, share in zip(draws, shares, strict=True)]


def _shrink(errors: Array) -> float:
    """Percent of what could be closed that is; nothing could where the gap is not above the floor."""
    before, _, after, floor = errors.tolist()
    return 100.0 * (before - after) / (before - floor) if before > floor * (1.0 + 1e-9) else 0.0


def _powers(amplitudes: Sequence[Complex], groups: Sequence[tuple[int, NDArray[np.intp]]]) -> Array:
    """Power (G, 12) by group."""
    return np.array([power_of(amplitudes[i][g]) for i, g in groups])
