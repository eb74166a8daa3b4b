"""A flight as the diagnosis sees it: what was measured by window and frequency, and what parameters predict.

Six coefficients of forces and moments, predicted from motion and commands (``sim.prediction``), and six readings of air
data and attitude, predicted from the inertial instruments (``kinematics``): together they are as many as the signals,
so that each measurement counts once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap import inferred
from sysid_node.gap.flights import Flight, thinned
from sysid_node.gap.kinematics import READINGS, Motion, motion_of, reconstruct
from sysid_node.gap.recent import Recent
from sysid_node.gap.spectra import Complex, Windows
from sysid_node.sim import EFFECTS, Simulator, parameters
from sysid_node.sim.layout import Layout, Model, Scalar
from sysid_node.sim.prediction import ACCELERATIONS, COEFFICIENTS, Signals, coefficients, predict, signals_of

#: What is compared.
CHANNELS = (*COEFFICIENTS, *READINGS)

#: Channels of a flight without lateral measurements.
_LONGITUDINAL = frozenset({"CL", "CD", "Cm", "V", "alpha", "theta"})

#: Memory of the observer of the air, at most and at least, s.
LONGEST, SHORTEST_MEMORY = 4.0, 0.15

#: Band in which gusts are told from noise, Hz.
_GUSTS = (0.3, 2.0)

#: Directions in which a prediction is differentiated at once: as many as most effects have parameters.
_LANES = 3

#: Predictions that a view keeps: fits ask for the same point again, and kinematics stay while forces are fitted.
_KEPT = 32

#: The same of slopes, which are large.
_SLOPES = 4

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
    "attitude": ("phi", "theta", "psi"),
}


_Kept = TypeVar("_Kept")


class Given(NamedTuple):
    """All that a prediction takes from a flight."""

    signals: Signals  # padded
    motion: Motion  # padded
    fading: Scalar  # s, of the observer
    step: Scalar  # s


@partial(jax.jit, static_argnums=0)
def _forces(layout: Layout, model: Model, theta: Scalar, given: Given) -> Scalar:
    """Coefficients (N, 6) that parameters (P,) expect."""
    return coefficients(model, given.signals, predict(layout, model, theta, given.signals, given.step))


@partial(jax.jit, static_argnums=0)
def _readings(layout: Layout, model: Model, theta: Scalar, given: Given) -> Scalar:
    """Air data and attitude (N, 6) that parameters (P,) expect."""
    return reconstruct(layout, model, theta, given.motion, given.fading, given.step)


@partial(jax.jit, static_argnums=(0, 1))
def _changes(
    expected: Callable[..., Scalar], layout: Layout, model: Model, theta: Scalar, directions: Scalar, given: Given
) -> tuple[Scalar, Scalar]:
    """What is expected (N, 6), and d expected along each of the directions (K, P): (N, 6, K)."""

    def along(direction: Scalar) -> tuple[Scalar, Scalar]:
        slope: tuple[Scalar, Scalar] = jax.jvp(lambda t: expected(layout, model, t, given), (theta,), (direction,))
        return slope

    values, slopes = jax.vmap(along, out_axes=(None, 2))(directions)
    return values, slopes


@partial(jax.jit, static_argnums=0)
def _changes_by_derivative(layout: Layout, model: Model, theta: Scalar, given: Given) -> Scalar:
    """d coefficients / d each of the file's derivatives, (N, 6, D).

    The same as along ``derivative_error``, at a quarter of the cost: no slope of the flow, the actuators or the
    kinematics has to be carried along.
    """

    def forces(derivatives: Scalar) -> Scalar:
        expected: Scalar = _forces(layout, model._replace(derivatives=derivatives), theta, given)
        return expected

    slopes: Scalar = jax.jacfwd(forces)(model.derivatives)
    return slopes


_reduced = jax.jit(coefficients)


@dataclass(frozen=True)
class View:
    """One flight, W windows of L lines, twelve ``CHANNELS``."""

    simulator: Simulator
    flight: Flight
    record: FlightRecord  # at the analysis rate
    given: Given
    windows: Windows
    series: Array  # (N, 12) as measured
    measured: Complex  # (W, L, 12)
    noise: Array  # (L, 12) power that the sensors' noise leaves in measured minus predicted
    axes: NDArray[np.bool_]  # (12,): what was measured
    gusts: float = 0.0  # rms of the air's motion across the flight path, m/s, as the aircraft file has it
    _forces: Recent[Complex] = field(default_factory=lambda: Recent(_KEPT), init=False, repr=False, compare=False)
    _slopes: Recent[Complex] = field(default_factory=lambda: Recent(_SLOPES), init=False, repr=False, compare=False)
    _once: dict[str, Any] = field(default_factory=dict, init=False, repr=False, compare=False)
    _readings: Recent[Complex] = field(default_factory=lambda: Recent(_KEPT), init=False, repr=False, compare=False)

    def once(self, name: str, work: Callable[[], _Kept]) -> _Kept:
        """What follows from this view alone, by name: worked out once."""
        if name not in self._once:
            self._once[name] = work()
        kept: _Kept = self._once[name]
        return kept

    @property
    def commands(self) -> Array:
        """(N, controls + 1) rad, and thrust N, as recorded."""
        return np.asarray(self.given.signals.commands)[: len(self.record)]

    def predicted_series(self, theta: Array) -> Array:
        """Channels (N, 12) that parameters (P,) expect."""
        return np.concatenate([self._series(_forces, theta), self._series(_readings, theta)], axis=1)

    def predicted(self, theta: Array) -> Complex:
        """The same by window and line, (W, L, 12)."""
        known = self._forces.get(theta.tobytes())
        forces = self.windows.transform(self._series(_forces, theta)) if known is None else known
        key = theta[_kinematic(self.simulator.layout)].tobytes()
        readings = self._readings.get(key)
        if readings is None:
            readings = self._readings.keep(key, self.windows.transform(self._series(_readings, theta)))
        return np.concatenate([self._forces.keep(theta.tobytes(), forces), readings], axis=2)

    def residual(self, theta: Array) -> Complex:
        """Measured minus predicted (W, L, 12), zero where not measured."""
        return np.asarray((self.measured - self.predicted(theta)) * self.axes)

    def slopes(self, theta: Array, indices: list[int]) -> Complex:
        """d predicted / d parameters of these indices, (W, L, 12, K). ``residual`` there costs little afterwards."""
        key = theta.tobytes() + np.array(indices, np.intp).tobytes()
        known = self._slopes.get(key)
        return self._slopes.keep(key, self._slopes_of(theta, indices) if known is None else known)

    def _slopes_of(self, theta: Array, indices: list[int]) -> Complex:
        slopes = np.zeros((*self.measured.shape, len(indices)), complex)
        layout, forces = self.simulator.layout, len(COEFFICIENTS)
        own = {self.simulator.names.index(f"derivative_error.{n}"): d for d, n in enumerate(layout.derivatives)}
        linear = [k for k, index in enumerate(indices) if index in own]
        others = [k for k, index in enumerate(indices) if index not in own]
        moving = [k for k in others if indices[k] in _kinematic(layout)]
        if linear:
            by_derivative = self._slopes_by_derivative(theta)
            slopes[:, :, :forces, linear] = by_derivative[..., [own[indices[k]] for k in linear]]
        for some in _lanes(others):
            slopes[:, :, :forces, some] = self._slopes_along(_forces, theta, [indices[k] for k in some])
        for some in _lanes(moving):
            slopes[:, :, forces:, some] = self._slopes_along(_readings, theta, [indices[k] for k in some])
        return np.asarray(slopes * self.axes[:, None])

    def _series(self, expected: Callable[..., Scalar], theta: Array) -> Array:
        """One of ``_forces`` and ``_readings`` (N, 6) at parameters (P,)."""
        s = self.simulator
        return np.asarray(expected(s.layout, s.model, jnp.asarray(theta), self.given))[: len(self.record)]

    def _slopes_by_derivative(self, theta: Array) -> Complex:
        """Of every derivative of the file, (W, L, 6, D); air data and attitude know of none."""
        s, samples = self.simulator, len(self.record)
        changes = np.asarray(_changes_by_derivative(s.layout, s.model, jnp.asarray(theta), self.given))[:samples]
        return self.windows.transform(changes)

    def _slopes_along(self, expected: Callable[..., Scalar], theta: Array, indices: list[int]) -> Complex:
        """Of at most ``_LANES`` entries of the vector, (W, L, 6, K); what is expected is kept."""
        s, directions, samples = self.simulator, np.zeros((_LANES, len(theta))), len(self.record)
        directions[np.arange(len(indices)), indices] = 1.0
        values, changes = _changes(expected, s.layout, s.model, jnp.asarray(theta), directions, self.given)
        entries = _kinematic(s.layout) if expected is _readings else slice(None)
        kept, key = (self._readings if expected is _readings else self._forces), theta[entries].tobytes()
        if kept.get(key) is None:
            kept.keep(key, self.windows.transform(np.asarray(values)[:samples]))
        return self.windows.transform(np.asarray(changes)[:samples, :, : len(indices)])


#: Of clocks and instruments, the effects that kinematics do not see: stamps of commands, and noise that has no value.
_ELSEWHERE = frozenset({"actuator_stamp_delay", "sensor_noise"})


@cache
def _kinematic(layout: Layout) -> list[int]:
    """Entries of the parameter vector that kinematics depend on: clocks, instruments, and where they are."""
    return [
        i
        for i, (effect, _) in enumerate(parameters.table(layout))
        if effect == "cg_shift" or (EFFECTS[effect].station in {"sensors", "clock"} and effect not in _ELSEWHERE)
    ]


def _lanes(places: list[int]) -> Iterator[list[int]]:
    """As many at a time as are differentiated at once."""
    return (places[first : first + _LANES] for first in range(0, len(places), _LANES))


def view_of(simulator: Simulator, flight: Flight, seed: int = 0) -> View:
    """The flight as windows and lines, with its noise floor. Raises InputError where a signal is missing."""
    record = thinned(flight, simulator.rate)
    windows = Windows.over(len(record), simulator.rate)
    axes = np.array([flight.lateral or name in _LONGITUDINAL for name in CHANNELS])
    axes[len(COEFFICIENTS) :] &= motion_of(record) is not None
    axes[CHANNELS.index("psi")] &= bool(np.isfinite(record["psi"]).all())
    axes[[CHANNELS.index(name) for name in flight.inferred]] = False
    calm = _measured_noise(_bare(simulator, flight, record, windows, axes, LONGEST), seed)
    calm = replace(calm, gusts=gusts_of(calm, simulator.neutral()))
    fading = _fading(calm)
    if fading == LONGEST:
        return calm
    shorter = _bare(simulator, flight, record, windows, axes, fading)
    return _measured_noise(replace(shorter, gusts=calm.gusts), seed)


def view_like(view: View, record: FlightRecord) -> View:
    """Another record of the same length, seen as this one: with its noise and its observer."""
    bare = _bare(view.simulator, view.flight, record, view.windows, view.axes, float(view.given.fading))
    return replace(bare, noise=view.noise)


def _measured_noise(view: View, seed: int) -> View:
    return replace(view, noise=_noise_power(view, np.random.default_rng(seed)))


def _bare(
    simulator: Simulator, flight: Flight, record: FlightRecord, windows: Windows, axes: NDArray[np.bool_], fading: float
) -> View:
    """A view that does not know its noise."""
    given, series = _given(simulator, record, fading)
    return View(simulator, flight, record, given, windows, series, windows.transform(series), np.ones((1, 12)), axes)


def gusts_of(view: View, theta: Array) -> float:
    """Root-mean-square motion of the air across the flight path (m/s): flow angles that no motion accounts for.

    With a long memory of the air, at parameters (P,); the median of the windows, which the observer's start leaves out.
    """
    vanes = len(COEFFICIENTS) + np.flatnonzero(view.axes[len(COEFFICIENTS) :][1:3]) + 1
    if not vanes.size:
        return _gusts_ahead(view, theta)
    calm = replace(view, given=view.given._replace(fading=jnp.asarray(LONGEST)))
    power = (np.abs(calm.residual(theta)[:, 1:, vanes]) ** 2).sum(axis=1)
    beyond = np.maximum(np.median(power, axis=0) - view.noise[1:, vanes].sum(axis=0), 0.0)
    return float(view.record["V"].mean() * np.sqrt(2.0 / view.windows.size * beyond.mean()))


def _gusts_ahead(view: View, theta: Array) -> float:
    """The same by the airspeed alone, where no vane was there: air that moves moves alike in all directions."""
    airspeed = CHANNELS.index("V")
    if not view.axes[airspeed]:
        return 0.0
    calm = replace(view, given=view.given._replace(fading=jnp.asarray(LONGEST)))
    power = (np.abs(calm.residual(theta)[:, 1:, airspeed]) ** 2).sum(axis=1)
    beyond = max(float(np.median(power) - view.noise[1:, airspeed].sum()), 0.0)
    return float(np.sqrt(2.0 / view.windows.size * beyond))


def _fading(calm: View) -> float:
    """The observer's best memory of the air (s), from innovations of a long one.

    Gusts wander (their power falls with the square of frequency), readings are noisy: the Kalman filter of a random
    walk of intensity q in white noise of density r forgets within sqrt(r / q).
    """
    lines = calm.windows.frequencies
    band = (lines > _GUSTS[0]) & (lines < _GUSTS[1])
    air = len(COEFFICIENTS) + np.flatnonzero(calm.axes[len(COEFFICIENTS) :][:3])
    if not air.size:
        return LONGEST
    power = (np.abs(calm.residual(calm.simulator.neutral())) ** 2).mean(axis=0)[np.ix_(band, air)]
    noise = calm.noise[np.ix_(band, air)]
    wandering = np.maximum(power - noise, 0.0) * (2.0 * np.pi * lines[band, None]) ** 2
    memory = np.sqrt(noise.mean(axis=0) / np.maximum(wandering.mean(axis=0), 1e-300))
    return float(np.clip(np.exp(np.log(memory).mean()), SHORTEST_MEMORY, LONGEST))


def _given(simulator: Simulator, record: FlightRecord, fading: float) -> tuple[Given, Array]:
    """What a prediction needs, padded, and the measured channels (N, 12)."""
    signals, short = signals_of(simulator, record), -len(record) % _BLOCK
    nothing = jnp.zeros((len(record), 3))
    motion = motion_of(record) or Motion(nothing, nothing, nothing, signals.air, nothing)
    signals, motion = (jax.tree.map(lambda x: _padded(x, short), parts) for parts in (signals, motion))
    shown = _padded(np.column_stack([record[name] for name in ACCELERATIONS]), short)
    forces = np.asarray(_reduced(simulator.model, signals, shown))[: len(record)]
    readings = np.concatenate([motion.air, motion.attitude], axis=1)[: len(record)]
    given = Given(signals, motion, jnp.asarray(fading), jnp.asarray(simulator.step))
    return given, np.concatenate([forces, readings], axis=1)


def _padded(series: Scalar | Array, short: int) -> Scalar:
    """A series (N, ...) with its end held for so many samples."""
    return jnp.pad(jnp.asarray(series), [(0, short)] + [(0, 0)] * (series.ndim - 1), mode="edge")


def _noise_power(view: View, random: np.random.Generator) -> Array:
    """Power (L, 12) by flying through the noise of the aircraft file again, a few times."""
    neutral = view.simulator.neutral()
    clean = view.residual(neutral)
    power = np.zeros(clean.shape[1:])
    for _ in range(_REALISATIONS):
        record = thinned(noisier(view, random), view.simulator.rate)
        again = _bare(view.simulator, view.flight, record, view.windows, view.axes, float(view.given.fading))
        power += (np.abs(again.residual(neutral) - clean) ** 2).mean(axis=0) / _REALISATIONS
    return np.maximum(view.windows.smoothed(power), 1e-18)


def noisier(view: View, random: np.random.Generator) -> Flight:
    """The flight with the sensors' noise added once more, as strong in the band as each topic's rate makes it."""
    record, sigmas = view.flight.record, view.simulator.aircraft.noise
    own_rate = 1.0 / float(np.median(np.diff(record.time)))
    columns = dict(record.columns)
    for sensor, names in _NOISE.items():
        rate = view.flight.imu_rate if sensor in {"accel", "gyro", "attitude"} else view.flight.air_rate
        spread = sigmas[sensor] * np.sqrt(own_rate / min(rate, own_rate))
        for name in names:
            if name in columns and name not in view.flight.filled:
                columns[name] = columns[name] + spread * random.standard_normal(len(record))
    columns |= _jittered(view, random)
    noisy = replace(record, columns=columns)
    if view.flight.inferred:
        noisy = inferred.with_angles(view.simulator.aircraft, noisy, view.flight.inferred, view.flight.source)
    return replace(view.flight, record=noisy)


def _jittered(view: View, random: np.random.Generator) -> dict[str, Array]:
    """Commands as other samples of the same rate might have caught them: a step falls anywhere between two samples."""
    record, aircraft = view.flight.record, view.simulator.aircraft
    period = 1.0 / view.flight.actuator_rate
    nodes = np.arange(0.0, record.duration + period, period)
    off = np.interp(record.time, nodes, period * (random.random(nodes.size) - 0.5))
    symbols = [*aircraft.control_symbols, *(["thrust"] if aircraft.throttle else [])]
    moved = [s for s in symbols if s not in view.flight.filled]
    return {s: np.interp(record.time + off, record.time, record[s]) for s in moved}


__all__ = ["CHANNELS", "COEFFICIENTS", "View", "view_of"]
