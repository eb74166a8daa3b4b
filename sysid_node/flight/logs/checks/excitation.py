"""How well the axes were excited: how surely a flight shows what its controls do to the angular rates.

A limit in deg/s would be another one for every size of aircraft. The measure here has no size: it is the standard
error of the response to a control, relative to the response itself, both as root mean squares over the flight. It falls
with larger and more inputs, and rises with gusts and noise.

The response is the part of a rate that follows linearly from the controls: a sum of Laguerre filters of them, fitted by
least squares (Wahlberg, "System identification using Laguerre models", IEEE Transactions on Automatic Control 36 (1991)
551-562). Their time constant, the one that fits best, is that of the aircraft. What is left over are gusts, noise and
all that is not linear. It is correlated in time, and is made white by an autoregression first (Cochrane and Orcutt,
"Application of Least Squares Regression to Relationships Containing Auto-Correlated Error Terms", Journal of the
American Statistical Association 44 (1949) 32-61). Where an autopilot moves a control as the rate is, that is taken for
a response, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid_node.flight.logs.autopilot_log import LoggedCommands, Signal
from sysid_node.flight.record import Array


class _Axis(NamedTuple):
    """The place of an axis' rate in an IMU's values, its control, and all controls that move it."""

    rate: int
    control: str
    movers: frozenset[str]


_AXES = {
    "roll": _Axis(3, "aileron", frozenset({"aileron", "rudder"})),
    "pitch": _Axis(4, "elevator", frozenset({"elevator"})),
    "yaw": _Axis(5, "rudder", frozenset({"aileron", "rudder"})),
}

#: Relative standard error up to which an axis is weakly excited: Tischler and Remple, "Aircraft and Rotorcraft System
#: Identification", 2nd ed. (2012), ask for Cramer-Rao bounds of 20 % at most. Half of it is well excited.
WEAKLY, WELL = 0.20, 0.10

#: Time constants of the filters, s: of the roll of a small UAV to the phugoid of a transport. Four filters of each
#: represent a mode of second order that is well damped.
_TIMES, _ORDER = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6), 4

_STEP = 0.04  # s, shortest step of the time base
_NOISE_ORDER = 4  # of the autoregression that makes gusts and noise white
_MOST_INPUTS, _ROWS_A_COLUMN = 6, 5
_SINGULAR = 1e-6  # as a share, of directions in which outputs that move together do not differ
_UNMOVED = 1e-6  # rad, or fractions
_POSSIBLE = 1e6  # nothing that is measured or commanded is larger, in any unit
_BRIDGED = 0.5  # s: values further apart than this are not connected
_PAUSE = 10.0  # s that are left of a longer pause: by far more than what happens in it acts behind it
_NO_EFFECT = {"throttle", "flap"}  # inputs that are no cause of an axis' motion to be looked for


class AxisExcitation(NamedTuple):
    """What moved an axis: ``rate`` (rad/s) and ``deflection`` are root mean squares about their means.

    ``control``: the axis' own where it is known by name, or the input to which the response is best known; empty for
    none. ``response``: what follows from it, rad/s root mean square. ``error``: the standard error of the response as a
    share of it; infinite where the flight does not tell.
    """

    rate: float
    control: str
    deflection: float
    response: float
    error: float

    @property
    def word(self) -> str:
        """The judgement in a word."""
        return "well" if self.error <= WELL else "weakly" if self.error <= WEAKLY else "hardly"


def excitation(imu: Signal, commands: LoggedCommands) -> dict[str, AxisExcitation]:
    """The excitation by axis, from an IMU's values (N, 6) in SI units and inputs (M, C) of any unit."""
    moved = _moved(commands)
    grid = _Grid.of(imu, commands, moved)
    names = [commands.names[i] for i in moved]
    found = {}
    for name, axis in _AXES.items():
        rate = _root_mean_square(imu.values[:, axis.rate])
        known = axis.control in commands.names
        movers = [i for i, one in enumerate(names) if one in axis.movers or not known]
        fitted = _responses(grid, axis, movers) if grid is not None else _unknown(len(movers))
        judged = {one: fitted[k] for k, i in enumerate(movers) if _is_judged(one := names[i], axis, known=known)}
        control = min(judged, key=lambda one: judged[one][1], default=axis.control if known else "")
        response, error = judged.get(control, _unknown(1)[0]).tolist()
        found[name] = AxisExcitation(rate, control, _spread(commands, control), response, error)
    return found


def _is_judged(name: str, axis: _Axis, *, known: bool) -> bool:
    return name == axis.control if known else name not in _NO_EFFECT


def _moved(commands: LoggedCommands) -> list[int]:
    """The places of the first six inputs that moved."""
    spreads = [_root_mean_square(column) for column in commands.signal.values.T]
    return [i for i in range(len(commands.names)) if spreads[i] > _UNMOVED][:_MOST_INPUTS]


def _spread(commands: LoggedCommands, control: str) -> float:
    if control not in commands.names or not len(commands.signal):
        return 0.0
    return _root_mean_square(commands.signal.values[:, commands.names.index(control)])


def _root_mean_square(values: Array) -> float:
    """That of the possible values (N,) about their mean."""
    possible = values[np.abs(values) < _POSSIBLE]
    return float(np.std(possible)) if possible.size else 0.0


class _Grid(NamedTuple):
    """Averages over equal steps: of the IMU (K, 6) and the inputs (K, C), and which of the steps hold measurements."""

    step: float  # s
    imu: Array
    inputs: Array
    known: NDArray[np.bool_]

    @classmethod
    def of(cls, imu: Signal, commands: LoggedCommands, places: Sequence[int]) -> _Grid | None:
        """The common time base; None where IMU and inputs do not overlap by some steps."""
        signals = _without_pauses([_clean(imu), _clean(commands.signal)])
        if min(time.size for time, _ in signals) < 2 or not places:
            return None
        step = max(float(np.median(np.diff(signals[0][0]))), _STEP)
        edges = np.arange(max(time[0] for time, _ in signals), min(time[-1] for time, _ in signals), step)
        if edges.size < 3:
            return None
        known = np.all([_connected(time, edges, step) for time, _ in signals], axis=0)
        motion, inputs = (_averages(time, values, edges) for time, values in signals)
        return cls(step, motion, inputs[:, places], known)


def _clean(signal: Signal) -> tuple[Array, Array]:
    """Times (s) that increase, and the values at them; what is not measured is taken from the samples around it."""
    stamp_ns, values = signal.stamp_ns, signal.values
    latest = np.maximum.accumulate(stamp_ns) if stamp_ns.size else stamp_ns
    fresh = np.concatenate([[True], stamp_ns[1:] > latest[:-1]]) if stamp_ns.size else np.empty(0, bool)
    time, kept = stamp_ns[fresh] / 1e9, values[fresh].astype(float)
    for column in kept.T:
        known = np.abs(column) < _POSSIBLE  # not so of NaN
        column[~known] = np.interp(time[~known], time[known], column[known]) if known.any() else 0.0
    return time, kept


def _without_pauses(signals: Sequence[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """The signals, of times (s) that increase, with pauses of any of them shortened to 10 s in all.

    A clock that was set ahead would otherwise ask for more steps than there is memory.
    """
    pauses: list[tuple[float, float]] = []
    for time, _ in signals:
        long = np.flatnonzero(np.diff(time) > _PAUSE)
        pauses += zip(time[long] + 0.5 * _PAUSE, time[long + 1] - 0.5 * _PAUSE, strict=True)
    cut: list[tuple[float, float]] = []
    for start, end in sorted(pauses):
        if cut and start <= cut[-1][1]:
            cut[-1] = cut[-1][0], max(cut[-1][1], end)
        else:
            cut.append((start, end))
    shortened = list(signals)
    for start, end in reversed(cut):
        for i, (time, values) in enumerate(shortened):
            kept = (time <= start) | (time >= end)
            later = np.where(time >= end, end - start, 0.0)
            shortened[i] = (time - later)[kept], values[kept]
    return shortened


def _connected(time: Array, edges: Array, step: float) -> NDArray[np.bool_]:
    """Which steps lie between samples that are near each other."""
    place = np.clip(np.searchsorted(time, edges, side="right"), 1, time.size - 1)
    near: NDArray[np.bool_] = time[place] - time[place - 1] <= max(3.0 * step, _BRIDGED)
    return near[:-1] & near[1:]


def _averages(time: Array, values: Array, edges: Array) -> Array:
    """The means (K, C) of columns (N, C) between the edges, on lines between the samples."""
    sums = np.vstack(
        [
            np.zeros(values.shape[1]),
            np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, np.newaxis], axis=0),
        ]
    )
    at_edges = np.column_stack([np.interp(edges, time, column) for column in sums.T])
    means: Array = np.diff(at_edges, axis=0) / np.diff(edges)[:, np.newaxis]
    return means


def _unknown(count: int) -> Array:
    """Responses (count, 2) of which nothing is known: zero, and an infinite error."""
    return np.column_stack([np.zeros(count), np.full(count, np.inf)])


def _responses(grid: _Grid, axis: _Axis, movers: Sequence[int]) -> Array:
    """The response of a rate to each of some inputs (rad/s root mean square), and its relative error (C, 2)."""
    whole = np.convolve(~grid.known, np.ones(_NOISE_ORDER + 1), mode="valid") == 0.0  # with what goes before a step
    if not movers or np.count_nonzero(whole) < _ROWS_A_COLUMN * (_ORDER * len(movers) + 2):
        return _unknown(len(movers))
    inputs = grid.inputs[:, movers] - grid.inputs[:, movers].mean(axis=0)
    inputs /= inputs.std(axis=0)
    slow = np.column_stack([np.ones(len(inputs)), np.linspace(-1.0, 1.0, len(inputs))])
    fits = []
    for constant in _TIMES:
        design = np.hstack([slow, *(_laguerre(column, grid.step / constant) for column in inputs.T)])
        fits.append((_whitened_fit(design, grid.imu[:, axis.rate], grid.known, whole), design))
    (_, coefficients, covariance), design = min(fits, key=lambda fit: fit[0].mean_square)
    found = _unknown(len(movers))
    for i in range(len(movers)):
        own = slice(2 + _ORDER * i, 2 + _ORDER * (i + 1))
        power = design[grid.known, own].T @ design[grid.known, own] / np.count_nonzero(grid.known)
        noise = float(np.sum(power * covariance[own, own]))
        energy = float(coefficients[own] @ power @ coefficients[own]) - noise
        if energy > 0.0:
            found[i] = np.sqrt(energy), np.sqrt(noise / energy)
    return found


class _Fit(NamedTuple):
    """Least-squares coefficients, their covariance, and what is left over, as a mean square."""

    mean_square: float
    coefficients: Array
    covariance: Array


def _whitened_fit(design: Array, values: Array, known: NDArray[np.bool_], whole: NDArray[np.bool_]) -> _Fit:
    """The fit of ``values`` (K,) by the columns of ``design`` (K, W), in noise that is made white.

    ``known`` (K,) are the rows that hold measurements, ``whole`` (K - 4,) the rows behind four others of them.
    """
    coefficients = np.linalg.lstsq(design[known], values[known], rcond=_SINGULAR)[0]
    for _ in range(2):
        residuals = values - design @ coefficients
        past = np.column_stack([residuals[_NOISE_ORDER - 1 - i : len(residuals) - 1 - i] for i in range(_NOISE_ORDER)])
        noise = np.linalg.lstsq(past[whole], residuals[_NOISE_ORDER:][whole], rcond=None)[0]
        taps = np.concatenate([[1.0], -noise])
        x = lfilter(taps, [1.0], design, axis=0)[_NOISE_ORDER:][whole]
        y = lfilter(taps, [1.0], values)[_NOISE_ORDER:][whole]
        coefficients = np.linalg.lstsq(x, y, rcond=_SINGULAR)[0]
    left = y - x @ coefficients
    mean_square = float(left @ left) / left.size
    inverse = np.linalg.pinv(x.T @ x, rcond=_SINGULAR**2, hermitian=True)
    covariance = np.asarray(inverse * mean_square * left.size / (left.size - x.shape[1]), np.float64)
    return _Fit(mean_square, np.asarray(coefficients, np.float64), covariance)


def _laguerre(values: Array, share: float) -> Array:
    """The outputs (K, 4) of Laguerre filters of an input (K,), the time constant of which is 1 / ``share`` steps."""
    pole = np.exp(-share)
    state: Array = lfilter([1.0 - pole], [1.0, -pole], values)
    outputs = [state]
    for _ in range(_ORDER - 1):
        state = lfilter([-pole, 1.0], [1.0, -pole], state)
        outputs.append(state)
    return np.column_stack(outputs)
