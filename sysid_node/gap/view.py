"""A flight as the diagnosis sees it: measured coefficients by window and frequency, and what parameters predict."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flights import Flight, thinned
from sysid_node.gap.spectra import Complex, Windows
from sysid_node.sim import Simulator
from sysid_node.sim.layout import Layout, Model, Scalar
from sysid_node.sim.prediction import ACCELERATIONS, COEFFICIENTS, Signals, coefficients, predict, signals_of

#: Directions in which a prediction is differentiated at once.
_LANES = 8

#: Flights are padded to multiples of so many samples: each length is another program to compile.
_BLOCK = 500

#: Realisations of the sensors' noise that its power is averaged over.
_REALISATIONS = 4

#: Columns each sensor's noise falls on.
_NOISE = {
    "accel": ("ax", "ay", "az"),
    "gyro": ("p", "q", "r"),
    "airspeed": ("V",),
    "alpha": ("alpha",),
    "beta": ("beta",),
}


@partial(jax.jit, static_argnums=0)
def _expected(layout: Layout, model: Model, theta: Scalar, signals: Signals, step: float) -> Scalar:
    return coefficients(model, signals, predict(layout, model, theta, signals, jnp.asarray(step)))


@partial(jax.jit, static_argnums=0)
def _changes(layout: Layout, model: Model, theta: Scalar, directions: Scalar, signals: Signals, step: float) -> Scalar:
    """d expected along each of the directions (K, P): (K, N, 6)."""

    def along(direction: Scalar) -> Scalar:
        slope: Scalar = jax.jvp(lambda t: _expected(layout, model, t, signals, step), (theta,), (direction,))[1]
        return slope

    return jax.vmap(along)(directions)


_reduced = jax.jit(coefficients)


@dataclass(frozen=True)
class View:
    """One flight, W windows of L lines, six coefficients (``prediction.COEFFICIENTS``)."""

    simulator: Simulator
    flight: Flight
    record: FlightRecord  # at the analysis rate
    signals: Signals  # padded
    windows: Windows
    series: Array  # (N, 6) measured coefficients
    measured: Complex  # (W, L, 6)
    noise: Array  # (L, 6) power that the sensors' noise leaves in measured minus predicted
    axes: Array  # (6,) bool: coefficients that were measured

    def predicted_series(self, theta: Array) -> Array:
        """Coefficients (N, 6) that parameters (P,) expect."""
        s = self.simulator
        expected = _expected(s.layout, s.model, jnp.asarray(theta), self.signals, s.step)
        return np.asarray(expected)[: len(self.record)]

    def predicted(self, theta: Array) -> Complex:
        """The same by window and line, (W, L, 6)."""
        return self.windows.transform(self.predicted_series(theta))

    def residual(self, theta: Array) -> Complex:
        """Measured minus predicted (W, L, 6), zero where not measured."""
        return np.asarray((self.measured - self.predicted(theta)) * self.axes)

    def slopes(self, theta: Array, indices: list[int]) -> Complex:
        """d predicted / d parameters of these indices, (W, L, 6, K)."""
        s, blocks = self.simulator, []
        for first in range(0, len(indices), _LANES):
            some = indices[first : first + _LANES]
            directions = np.zeros((_LANES, len(theta)))
            directions[np.arange(len(some)), some] = 1.0
            changes = _changes(s.layout, s.model, jnp.asarray(theta), directions, self.signals, s.step)
            blocks.append(np.asarray(changes)[: len(some), : len(self.record)])
        stacked = np.moveaxis(np.concatenate(blocks), 0, 2)
        return np.asarray(self.windows.transform(stacked) * self.axes[:, None])


def view_of(simulator: Simulator, flight: Flight, seed: int = 0) -> View:
    """The flight as windows and lines, with its noise floor. Raises InputError where a signal is missing."""
    record = thinned(flight, simulator.rate)
    signals, series = _signals(simulator, record)
    windows = Windows.over(len(record), simulator.rate)
    measured = windows.transform(series)
    axes = np.array([True, True, flight.lateral, flight.lateral, True, flight.lateral])
    bare = View(simulator, flight, record, signals, windows, series, measured, np.ones((1, 6)), axes)
    noise = _noise_power(bare, np.random.default_rng(seed))
    return View(simulator, flight, record, signals, windows, series, measured, noise, axes)


def _signals(simulator: Simulator, record: FlightRecord) -> tuple[Signals, Array]:
    """Signals, padded, and the measured coefficients (N, 6)."""
    signals = signals_of(simulator, record)
    short = -len(record) % _BLOCK
    padded = Signals(*(jnp.asarray(np.pad(x, [(0, short)] + [(0, 0)] * (x.ndim - 1), mode="edge")) for x in signals))
    shown = np.column_stack([record[name] for name in ACCELERATIONS])
    shown = np.pad(shown, [(0, short), (0, 0)], mode="edge")
    series = np.asarray(_reduced(simulator.model, padded, jnp.asarray(shown)))[: len(record)]
    return padded, series


def _noise_power(view: View, random: np.random.Generator) -> Array:
    """Power (L, 6) by flying through the noise of the aircraft file again, a few times."""
    neutral = view.simulator.neutral()
    clean = view.residual(neutral)
    power = np.zeros(clean.shape[1:])
    for _ in range(_REALISATIONS):
        record = thinned(_noisier(view, random), view.simulator.rate)
        signals, series = _signals(view.simulator, record)
        again = View(
            view.simulator, view.flight, record, signals, view.windows, series,
            view.windows.transform(series), view.noise, view.axes,
        )  # fmt: skip
        power += (np.abs(again.residual(neutral) - clean) ** 2).mean(axis=0) / _REALISATIONS
    return np.maximum(view.windows.smoothed(power), 1e-18)


def _noisier(view: View, random: np.random.Generator) -> Flight:
    """The flight with the sensors' noise added once more, as strong in the band as each topic's rate makes it."""
    record, sigmas = view.flight.record, view.simulator.aircraft.noise
    own_rate = 1.0 / float(np.median(np.diff(record.time)))
    columns = dict(record.columns)
    for sensor, names in _NOISE.items():
        rate = view.flight.imu_rate if sensor in {"accel", "gyro"} else view.flight.air_rate
        spread = sigmas[sensor] * np.sqrt(own_rate / min(rate, own_rate))
        for name in names:
            if name not in view.flight.filled:
                columns[name] = columns[name] + spread * random.standard_normal(len(record))
    columns |= _jittered(view, random)
    return replace(view.flight, record=replace(record, columns=columns))


def _jittered(view: View, random: np.random.Generator) -> dict[str, Array]:
    """Commands as other samples of the same rate might have caught them: a step falls anywhere between two samples."""
    record, aircraft = view.flight.record, view.simulator.aircraft
    period = 1.0 / view.flight.actuator_rate
    nodes = np.arange(0.0, record.duration + period, period)
    off = np.interp(record.time, nodes, period * (random.random(nodes.size) - 0.5))
    symbols = [*aircraft.control_symbols, *(["thrust"] if aircraft.throttle else [])]
    moved = [s for s in symbols if s not in view.flight.filled]
    return {s: np.interp(record.time + off, record.time, record[s]) for s in moved}


__all__ = ["COEFFICIENTS", "View", "view_of"]
