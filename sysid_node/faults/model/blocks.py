"""Averages aligned samples to blocks of 0.1 s: coefficients, their regressors, and air data.

The equations are those of ``online.frequency.regression_signals``: k C = k (C_0 + C_alpha alpha + ...), averaged over a
block. The angular accelerations of a moment equation become the increment of angular momentum over the block, so that
nothing is differentiated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults.model import lagged_controls
from sysid_node.faults.model.lagged_controls import LAGS, LaggedControls
from sysid_node.online.frequency import regression_signals as signals
from sysid_node.online.frequency.regression_signals import OFFSET, OUTPUTS, MomentumGain, ScalarSignals, SignalLayout
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]

PERIOD = 0.1  # s
MOST_GAP = 0.25  # s between samples; after a longer gap a new block begins
_DRIFT = OFFSET + 2
_AIR = [SAMPLE_COLUMNS.index(name) for name in ("V", "alpha", "beta")]
_THRUST = SAMPLE_COLUMNS.index("thrust")


class Block(NamedTuple):
    """Means over a block, which ends at ``time`` (s)."""

    time: float
    outputs: Array  # (6,) k C
    regressors: Array  # (W,) columns of the layout; k in column OFFSET
    behind: Array  # (m J,) k times what the controls are behind through each lag, rad (see ``lagged_controls``)
    air: Array  # (3,) V m/s, alpha, beta rad, as measured
    samples: int
    follows: bool  # whether it begins at the end of the block before


@dataclass
class BlockAverager:
    """The state of the averaging."""

    layout: SignalLayout
    signals: ScalarSignals
    gain: MomentumGain
    lagged: LaggedControls
    controls: slice  # where they are in a sample
    area: Array  # of the layout's columns, then of ``behind``
    air: Array = field(default_factory=lambda: np.zeros(3))
    previous: tuple[float, Array, tuple[float, ...]] | None = None
    begin: float = math.nan  # s
    samples: int = 0
    unbroken: bool = False


def init(aircraft: Aircraft) -> BlockAverager:
    """The state before the first sample."""
    layout, count = signals.layout(aircraft), len(aircraft.controls)
    equations = signals.scalar_signals(aircraft), signals.momentum_gain(aircraft)
    area = np.zeros(layout.width + count * len(LAGS))
    return BlockAverager(layout, *equations, LaggedControls(count), _places(aircraft), area)


def add(state: BlockAverager, time: float, sample: Sequence[float]) -> Block | None:
    """Take an aligned sample (``SAMPLE_COLUMNS``, then controls) at ``time`` (s); returns a block when it is complete.

    Samples that lack a needed value, or are not later than the last, are left out.
    """
    values = list(sample)
    if math.isnan(values[_THRUST]):
        values[_THRUST] = 0.0  # not measured: taken as none
    before = state.previous
    if not math.isfinite(math.fsum(values)) or (before is not None and time <= before[0]):
        return None
    row, angles = state.signals(values)
    row.insert(_DRIFT, 0.0)
    row += [row[OFFSET] * off for off in state.lagged.follow(time, values[state.controls])]
    now = state.previous = (time, np.array(row), (*values[3:6], *angles))
    if before is None or time - before[0] > MOST_GAP:
        _begin(state, time, unbroken=False)
        return None
    step = time - before[0]
    area = (0.5 * step) * (before[1] + now[1])
    area[:OUTPUTS] += state.gain(before[2], now[2])
    state.area += area
    state.air += step * np.array([values[i] for i in _AIR])
    state.samples += 1
    return _complete(state, time) if time - state.begin >= PERIOD - 1e-6 else None


def of_record(aircraft: Aircraft, time: Array, samples: Array) -> list[Block]:
    """The blocks of samples (N, M) at times (N,) s, as ``add`` gives them except for rounding, but much faster."""
    values = np.array(samples, dtype=np.float64)
    values[np.isnan(values[:, _THRUST]), _THRUST] = 0.0
    usable = np.isfinite(values.sum(axis=1))
    time, values = time[usable], values[usable]
    rows, angles = signals.array_signals(aircraft)(list(values.T))
    rows.insert(_DRIFT, np.zeros_like(time))
    behind = lagged_controls.of_record(time, values[:, _places(aircraft)])
    width, motion = len(rows), [*values.T[3:6], *angles]
    row = np.column_stack([*rows, rows[OFFSET][:, None] * behind])
    steps = np.diff(time)
    area = 0.5 * steps[:, None] * (row[1:] + row[:-1])
    area[:, :OUTPUTS] += np.stack(signals.momentum_gain(aircraft)([m[:-1] for m in motion], [m[1:] for m in motion]), 1)
    whole = np.vstack([np.zeros(row.shape[1]), np.cumsum(area, axis=0)])
    air = np.vstack([np.zeros(3), np.cumsum(steps[:, None] * values[1:, _AIR], axis=0)])
    found, first, unbroken = [], 0, False
    for last in range(1, time.size):
        if steps[last - 1] > MOST_GAP:
            first, unbroken = last, False
        elif time[last] - time[first] >= PERIOD - 1e-6:
            duration = time[last] - time[first]
            means, seen = (whole[last] - whole[first]) / duration, (air[last] - air[first]) / duration
            parts = means[:OUTPUTS], means[:width], means[width:]
            found.append(Block(float(time[last]), *parts, seen, last - first, unbroken))
            first, unbroken = last, True
    return found


def _places(aircraft: Aircraft) -> slice:
    """Where the controls are in a sample."""
    return slice(len(SAMPLE_COLUMNS), len(SAMPLE_COLUMNS) + len(aircraft.controls))


def _complete(state: BlockAverager, time: float) -> Block:
    duration = time - state.begin
    means, width = state.area / duration, state.layout.width
    parts = means[:OUTPUTS], means[:width], means[width:]
    block = Block(time, *parts, state.air / duration, state.samples, state.unbroken)
    _begin(state, time, unbroken=True)
    return block


def _begin(state: BlockAverager, time: float, unbroken: bool) -> None:
    state.begin, state.samples, state.unbroken = time, 0, unbroken
    state.area, state.air = np.zeros_like(state.area), np.zeros(3)
