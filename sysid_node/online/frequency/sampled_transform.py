"""The transform of sampled signals: samples are collected and transformed several at once.

One call of the transform costs nearly as much for one interval as for ten. So samples wait until somebody wants the
transform, or until ``MOST_WAITING`` wait. When that is makes no difference to the result, to the last bit: each
interval's part is computed element by element, and the transform's blocks depend on the times alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency import fourier_transform
from sysid_node.online.frequency.fourier_transform import Transform
from sysid_node.online.frequency.regression_signals import OFFSET, OUTPUTS, SignalLayout

Array = NDArray[np.float64]
MOST_WAITING = 2 * fourier_transform.BLOCK  # samples


@dataclass
class SampledTransform:
    """The transform of all samples up to some time, and the samples since then. T signals are transformed."""

    layout: SignalLayout
    transform: Transform
    times: list[float] = field(default_factory=list)  # s: the last sample transformed, then those that wait
    rows: list[Sequence[float]] = field(default_factory=list)  # (T,) signals of each
    gains: list[Sequence[float]] = field(default_factory=list)  # (6,) or (6 + m,) of each interval, see ``append``
    recent: list[Array] = field(default_factory=list)  # (n, T) signals transformed since this was last cleared

    @property
    def last(self) -> float:
        """Time of the last sample, s."""
        return self.times[-1] if self.times else self.transform.last


def append(state: SampledTransform, time: float, row: Sequence[float], gain: Sequence[float]) -> None:
    """Take in the sample ``row`` (T,) at ``time`` (s), to which the signals go in straight lines from the one before.

    ``gain`` (6,) is what the areas of the coefficients gain by the angular accelerations in between; behind them may
    stand what those of the m controls have more than straight lines.
    """
    state.times.append(time)
    state.rows.append(row)
    state.gains.append(gain)
    if len(state.times) > MOST_WAITING:
        transform_waiting(state)


def begin_at(state: SampledTransform, time: float, row: Sequence[float]) -> None:
    """Forget all samples; the next interval begins with this sample (T,) at ``time`` (s)."""
    state.times, state.rows, state.gains = [time], [row], []
    state.recent.clear()
    fourier_transform.restart(state.transform, time)


def restart(state: SampledTransform) -> None:
    """Forget the transform; it goes on after the last sample."""
    transform_waiting(state)
    state.recent.clear()
    fourier_transform.restart(state.transform, state.last)


def transform_waiting(state: SampledTransform) -> None:
    """Transform the samples that wait."""
    if not state.gains:
        return
    rows, times = np.array(state.rows), state.times
    steps = np.array([end - begin for begin, end in pairwise(times)])[:, None]
    areas, slants = over_intervals(state.layout, steps, rows, np.array(state.gains))
    fourier_transform.add(state.transform, times[:-1], times[1:], areas, slants)
    state.recent.append(rows[1:])
    state.times, state.rows, state.gains = times[-1:], state.rows[-1:], []


def over_intervals(layout: SignalLayout, steps: Array, rows: Array, gains: Array) -> tuple[Array, Array]:
    """Areas and slants (n, T) of the signals ``rows`` (n + 1, T) over ``steps`` (n, 1) s; see ``fourier_transform``.

    ``gains`` (n, 6) are added to the coefficients' areas, (n, m) behind them to those of the controls. The signal of a
    control is k times the control, and that of its rate k times the rate: a servo acts on the control alone, and the
    rate of the product would add the rate of k to its response. Its area is the mean k times the control's increment.
    """
    before, after = rows[:-1], rows[1:]
    slants = after - before
    areas = (after + before) * (0.5 * steps)
    areas[:, :OUTPUTS] += gains[:, :OUTPUTS]
    if gains.shape[1] > OUTPUTS:
        areas[:, layout.deflections] += gains[:, OUTPUTS:]
    controls, pressure = layout.deflections, slice(OFFSET, OFFSET + 1)
    increments = after[:, controls] / after[:, pressure] - before[:, controls] / before[:, pressure]
    areas[:, layout.rates] = 0.5 * (before[:, pressure] + after[:, pressure]) * increments
    slants *= 0.5 * steps * steps
    if gains.shape[1] > OUTPUTS:
        # the rate's first moment about the interval's middle, in units of which a slant is six
        slants[:, layout.rates] = -6.0 * gains[:, OUTPUTS:]
    return areas, slants


def current(state: SampledTransform) -> Array:
    """(R, width) the transform up to the last sample, see ``fourier_transform.current``."""
    transform_waiting(state)
    return fourier_transform.current(state.transform)


def at_rest(state: SampledTransform) -> SampledTransform:
    """A copy that stays at the last sample: none is to be added."""
    transform_waiting(state)
    return SampledTransform(state.layout, fourier_transform.at_rest(state.transform), [state.last])


def take_out(state: SampledTransform, part: Array) -> None:
    """Forget a ``part`` (R, width) of the transform up to the last sample."""
    transform_waiting(state)
    fourier_transform.take_out(state.transform, part)
