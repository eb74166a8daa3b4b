"""A flight as the diagnosis sees it: what was measured by window and frequency, and what parameters predict.

Six coefficients of forces and moments, predicted from motion and commands (``sim.prediction``), and six readings of air
data and attitude, predicted from the inertial instruments (``kinematics``): together they are as many as the signals,
so that each measurement counts once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.residuals.flight_path_reconstruction import (
    READINGS,
    Flow,
    Motion,
    flow_of,
    motion_of,
    reconstruct,
)
from sysid_node.gap.residuals.lru_cache import LruCache
from sysid_node.gap.residuals.windowed_spectra import Complex, Windows
from sysid_node.sim import EFFECTS, Simulator
from sysid_node.sim.compiled.programs import kept
from sysid_node.sim.model import parameters
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import Layout, Model, Scalar
from sysid_node.sim.model.parameters import Parameters
from sysid_node.sim.model.prediction import COEFFICIENTS, Accelerations, Signals, coefficients, predict, signals_of

#: What is compared.
CHANNELS = (*COEFFICIENTS, *READINGS)
_FORCES, _READINGS = slice(len(COEFFICIENTS)), slice(len(COEFFICIENTS), None)

#: Longest memory of the observer of the air, s.
LONGEST_MEMORY = 4.0

#: Directions in which a prediction is differentiated at once: as many as most effects have parameters, or as many as
#: there are biases and clocks.
_LANES, _WIDE = 3, 9

#: Predictions that a view keeps: fits ask for the same point again, and kinematics stay while forces are fitted.
_KEPT = 32

#: The same of slopes, and of what others keep here, which are large.
_SLOPES, _LATELY = 4, 8

#: Flights are padded to multiples of so many samples: each length is another program to compile.
_BLOCK = 500

_Kept = TypeVar("_Kept")

#: Of layout, model, parameters (P,), what a flight gives, and the flow: six channels (N,), put together outside of XLA,
#: which would work all of them out for each entry of a table.
Channels = Sequence[Scalar]
Expected = Callable[..., Channels]


class ObserverMemory(NamedTuple):
    """How long what the inertial instruments tell of the air's motion is remembered, s."""

    observer: Scalar | float  # before the air data are believed
    vane: Scalar | float  # before the rate of alpha follows the vane; zero: at once


class PredictionInputs(NamedTuple):
    """All that a prediction takes from a flight."""

    signals: Signals  # padded
    motion: Motion | None  # padded; None without attitude
    memory: ObserverMemory
    step: Scalar  # s


def _flow(layout: Layout, model: Model, theta: Parameters, _: Scalar, given: PredictionInputs) -> Flow | None:
    """The flow by the inertial instruments, which ``kinematic`` parameters alone move; none without attitude."""
    if given.motion is None:
        return None
    chain = Chain.of(layout, model, theta, given.step, jnp.zeros(()))
    return flow_of(chain, given.motion, given.memory.vane)


@partial(jax.jit, static_argnums=0)  # traced once for all that it is part of
def _forces_in(
    layout: Layout, model: Model, theta: Parameters, acting: Scalar, given: PredictionInputs, flow: Flow | None
) -> Channels:
    """Coefficients that parameters (P,) expect in a flow that is known; ``acting`` (P,) as ``predict`` has it."""
    signals = given.signals
    if flow is not None:
        signals = signals._replace(velocity=flow.velocity, alpha_rate=flow.alpha_rate)
    return tuple(coefficients(model, given.signals, predict(layout, model, theta, signals, given.step, acting)))


@partial(jax.jit, static_argnums=0)
def _readings(
    layout: Layout, model: Model, theta: Parameters, _: Scalar, given: PredictionInputs, __: Flow | None = None
) -> Channels:
    """Air data and attitude that parameters (P,) expect; nothing without attitude."""
    if given.motion is None:
        return (jnp.zeros(given.signals.density.size),) * len(READINGS)
    return tuple(reconstruct(layout, model, theta, given.motion, given.memory.observer, given.step).T)


def _channels(
    layout: Layout, model: Model, theta: Parameters, acting: Scalar, given: PredictionInputs, _: Flow | None
) -> Channels:
    """All of them, where the parameters move the flow, too."""
    forces = _forces_in(layout, model, theta, acting, given, _flow(layout, model, theta, acting, given))
    return (*forces, *_readings(layout, model, theta, acting, given))


@kept(2)
def _at(expected: Callable[..., _Kept], layout: Layout, *where: Any) -> _Kept:
    """What is expected, or the flow, there."""
    return expected(layout, *where)


@kept(2)
def _changes(
    expected: Expected,
    layout: Layout,
    model: Model,
    theta: Scalar,
    acting: Scalar,
    directions: Scalar,
    given: PredictionInputs,
    flow: Flow | None,
) -> tuple[Channels, Channels]:
    """What is expected (N,) by channel, and d expected along directions (K, M) of what may ``move`` it: (N, K)."""
    moving, still = _moving(expected, layout), jnp.unstack(theta)

    def there(entries: Scalar) -> Channels:
        point = list(still)
        for place, entry in zip(moving, jnp.unstack(entries), strict=True):
            point[place] = entry
        return tuple(expected(layout, model, point, acting, given, flow))

    def along(direction: Scalar) -> tuple[Channels, Channels]:
        slope: tuple[Channels, Channels] = jax.jvp(there, (theta[np.array(moving)],), (direction,))
        return slope

    values, slopes = jax.vmap(along, out_axes=(None, 1))(directions)
    return values, slopes


@kept(1)
def _changes_by_derivative(
    layout: Layout, model: Model, theta: Scalar, acting: Scalar, given: PredictionInputs, flow: Flow | None
) -> Channels:
    """d coefficients / d each of the file's derivatives, (N, D) each.

    The same as along ``derivative_error``, at a quarter of the cost: no slope of the flow, the actuators or the
    kinematics has to be carried along.
    """

    def forces(derivatives: Scalar) -> Channels:
        return tuple(_forces_in(layout, model._replace(derivatives=derivatives), theta, acting, given, flow))

    slopes: Channels = jax.jacfwd(forces)(model.derivatives)
    return slopes


_reduced = jax.jit(coefficients)

#: Of a record: what the inertial instruments showed.
_ACCELERATIONS = (("ax", "ay", "az"), ("p_rate", "q_rate", "r_rate"))


@dataclass(frozen=True)
class ResidualModel:
    """One flight, W windows of L lines, twelve ``CHANNELS``."""

    simulator: Simulator
    flight: GapFlight
    record: FlightRecord  # at the analysis rate
    given: PredictionInputs
    windows: Windows
    series: Array  # (N, 12) as measured
    measured: Complex  # (W, L, 12)
    noise: Array  # (L, 12) power that the sensors' noise leaves in measured minus predicted
    axes: NDArray[np.bool_]  # (12,): what was measured
    gusts: float = 0.0  # rms of the air's motion across the flight path, m/s, as the aircraft file has it
    _forces: LruCache[Complex] = field(default_factory=lambda: LruCache(_KEPT), init=False, repr=False, compare=False)
    _slopes: LruCache[Complex] = field(default_factory=lambda: LruCache(_SLOPES), init=False, repr=False, compare=False)
    _flows: LruCache[Flow | None] = field(
        default_factory=lambda: LruCache(_KEPT), init=False, repr=False, compare=False
    )
    _lately: LruCache[Any] = field(default_factory=lambda: LruCache(_LATELY), init=False, repr=False, compare=False)
    _once: dict[str, Any] = field(default_factory=dict, init=False, repr=False, compare=False)
    _readings: LruCache[Complex] = field(default_factory=lambda: LruCache(_KEPT), init=False, repr=False, compare=False)

    def once(self, name: str, work: Callable[[], _Kept]) -> _Kept:
        """What follows from this view alone, by name: worked out once."""
        if name not in self._once:
            self._once[name] = work()
        kept: _Kept = self._once[name]
        return kept

    def lately(self, key: bytes, work: Callable[[], _Kept]) -> _Kept:
        """What follows from this view and what the key tells of: worked out anew when it was long not asked for."""
        kept: _Kept | None = self._lately.get(key)
        return self._lately.keep(key, work()) if kept is None else kept

    def programs(self) -> Iterator[Callable[[], object]]:
        """What calls each of the programs of slopes, which take their time to load or to compile, once."""
        neutral, motion = self.simulator.neutral(), kinematic_parameters(self.simulator.layout)
        other = _moving(_forces_in, self.simulator.layout)[:1]
        yield partial(self._slopes_along, _channels, neutral, motion[:_WIDE])
        yield partial(self._slopes_along, _channels, neutral, motion[:1])
        yield partial(self._slopes_along, _forces_in, neutral, other)
        yield partial(self._slopes_by_derivative, neutral)

    @property
    def commands(self) -> Array:
        """(N, controls + 1) rad, and thrust N, as recorded."""
        return np.asarray(self.given.signals.commands)[: len(self.record)]

    def predicted_series(self, theta: Array) -> Array:
        """Channels (N, 12) that parameters (P,) expect."""
        return np.concatenate([self._series(_forces_in, theta), self._series(_readings, theta)], axis=1)

    def predicted(self, theta: Array) -> Complex:
        """The same by window and line, (W, L, 12)."""
        known = self._forces.get(theta.tobytes())
        forces = self.windows.transform(self._series(_forces_in, theta)) if known is None else known
        key = theta[kinematic_parameters(self.simulator.layout)].tobytes()
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

    def slopes_of_readings(self, theta: Array, indices: list[int]) -> Complex:
        """d predicted air data and attitude / d parameters of these indices, (W, L, 6, K)."""
        slopes = np.zeros((*self.measured.shape, len(indices)), complex)
        self._fill(
            slopes,
            theta,
            indices,
            [k for k, i in enumerate(indices) if i in kinematic_parameters(self.simulator.layout)],
        )
        return slopes[:, :, len(COEFFICIENTS) :]

    def _slopes_of(self, theta: Array, indices: list[int]) -> Complex:
        slopes = np.zeros((*self.measured.shape, len(indices)), complex)
        layout, motion, forces = self.simulator.layout, kinematic_parameters(self.simulator.layout), len(COEFFICIENTS)
        own = {self.simulator.names.index(f"derivative_error.{n}"): d for d, n in enumerate(layout.derivatives)}
        linear, moving = ([k for k, index in enumerate(indices) if index in some] for some in (own, motion))
        if linear:
            by_derivative = self._slopes_by_derivative(theta)
            slopes[:, :, :forces, linear] = by_derivative[..., [own[indices[k]] for k in linear]]
        for some in _lanes([k for k, index in enumerate(indices) if index not in own and index not in motion], _LANES):
            slopes[:, :, :forces, some] = self._slopes_along(_forces_in, theta, [indices[k] for k in some])
        self._fill(slopes, theta, indices, moving)
        return np.asarray(slopes * self.axes[:, None])

    def _fill(self, slopes: Complex, theta: Array, indices: list[int], moving: list[int]) -> None:
        """Puts slopes of all channels where they belong: those of the places (of indices) that move the flow."""
        wide = len(moving) // _WIDE * _WIDE if len(moving) % _WIDE <= _LANES else len(moving)
        for some in (*_lanes(moving[:wide], _WIDE), *_lanes(moving[wide:], _LANES)):
            slopes[..., some] = self._slopes_along(_channels, theta, [indices[k] for k in some])

    def _flow(self, theta: Array) -> Flow | None:
        """The flow at parameters (P,), as long as none moves it."""
        key = theta[kinematic_parameters(self.simulator.layout)].tobytes()
        known = self._flows.get(key)
        return self._flows.keep(key, self._at(_flow, theta)) if known is None else known

    def _series(self, expected: Expected, theta: Array) -> Array:
        """One of ``_forces_in`` and ``_readings`` (N, 6) at parameters (P,)."""
        return _table(self._at(expected, theta, self._flow(theta)), len(self.record))

    def _at(self, expected: Callable[..., _Kept], theta: Array, *flow: Flow | None) -> _Kept:
        layout, model = self.simulator.layout, self.simulator.model
        there: _Kept = _at(expected, layout, model, theta, self._acting(theta), self.given, *flow)
        return there

    def _acting(self, theta: Array) -> NDArray[np.bool_]:
        """Which parameters (P,) are not neutral."""
        return np.asarray(theta != self.simulator.neutral())

    def _slopes_by_derivative(self, theta: Array) -> Complex:
        """Of every derivative of the file, (W, L, 6, D); air data and attitude know of none."""
        s, samples = self.simulator, len(self.record)
        changes = _changes_by_derivative(s.layout, s.model, theta, self._acting(theta), self.given, self._flow(theta))
        return self.windows.transform(_table(changes, samples))

    def _slopes_along(self, expected: Expected, theta: Array, indices: list[int]) -> Complex:
        """Of at most ``_WIDE`` entries of the vector, (W, L, channels, K); what is expected is kept."""
        s, acting, moving = self.simulator, self._acting(theta), _moving(expected, self.simulator.layout)
        acting[indices] = True
        directions = np.zeros((_LANES if len(indices) <= _LANES else _WIDE, len(moving)))
        directions[np.arange(len(indices)), [moving.index(i) for i in indices]] = 1.0
        values, changes = _changes(
            expected, s.layout, s.model, theta, acting, directions, self.given, self._flow(theta)
        )
        self._keep(theta, _table(values, len(self.record)))
        return self.windows.transform(_table(changes, len(self.record), len(indices)))

    def _keep(self, theta: Array, series: Array) -> None:
        """Forces (N, 6), or all channels (N, 12), that are expected at parameters (P,)."""
        motion = theta[kinematic_parameters(self.simulator.layout)].tobytes()
        for known, key, channels in ((self._forces, theta.tobytes(), _FORCES), (self._readings, motion, _READINGS)):
            if series[:, channels].size and known.get(key) is None:
                known.keep(key, self.windows.transform(series[:, channels]))


#: Of clocks and instruments, the effects that kinematics do not see: stamps of commands, and noise that has no value.
_ELSEWHERE = frozenset({"actuator_stamp_delay", "sensor_noise"})


@cache
def kinematic_parameters(layout: Layout) -> list[int]:
    """Entries of the parameter vector that kinematics depend on: clocks, instruments, and where they are."""
    return [
        i
        for i, (effect, _) in enumerate(parameters.table(layout))
        if effect == "cg_shift" or (EFFECTS[effect].station in {"sensors", "clock"} and effect not in _ELSEWHERE)
    ]


@cache
def _moving(expected: Expected, layout: Layout) -> list[int]:
    """Entries of the parameter vector that what is expected is differentiated by."""
    motion = kinematic_parameters(layout)
    return [i for i in range(len(parameters.table(layout))) if i not in motion] if expected is _forces_in else motion


def _lanes(places: list[int], most: int) -> Iterator[list[int]]:
    """At most so many at a time."""
    return (places[first : first + most] for first in range(0, len(places), most))


def noiseless_model(
    simulator: Simulator,
    flight: GapFlight,
    record: FlightRecord,
    windows: Windows,
    axes: NDArray[np.bool_],
    memory: ObserverMemory,
) -> ResidualModel:
    """A view that does not know its noise."""
    given, series = _given(simulator, record, memory)
    return ResidualModel(
        simulator, flight, record, given, windows, series, windows.transform(series), np.ones((1, 12)), axes
    )


def _given(simulator: Simulator, record: FlightRecord, memory: ObserverMemory) -> tuple[PredictionInputs, Array]:
    """What a prediction needs, padded, and the measured channels (N, 12)."""
    signals, short = signals_of(simulator, record), -len(record) % _BLOCK
    motion = motion_of(record)
    signals, motion = (jax.tree.map(lambda x: _padded(x, short), parts) for parts in (signals, motion))
    shown = [Vector(*(_padded(record[name], short) for name in names)) for names in _ACCELERATIONS]
    forces = _table(_reduced(simulator.model, signals, Accelerations(*shown)), len(record))
    read = jnp.zeros((len(shown), len(READINGS))) if motion is None else jnp.hstack([motion.air, motion.attitude])
    readings = np.asarray(read)[: len(record)]
    given = PredictionInputs(signals, motion, jax.tree.map(jnp.asarray, memory), jnp.asarray(simulator.step))
    return given, np.concatenate([forces, readings], axis=1)


def _table(channels: Channels, samples: int, *most: int) -> Array:
    """Channels (n, ...), n at least the samples N, as one (N, channels, ...); of further axes the first ``most``."""
    wanted = tuple(map(slice, (samples, *most)))
    return np.stack([np.asarray(channel)[wanted] for channel in channels], axis=1)


def _padded(series: Scalar | Array, short: int) -> Scalar:
    """A series (N, ...) with its end held for so many samples."""
    return jnp.pad(jnp.asarray(series), [(0, short)] + [(0, 0)] * (series.ndim - 1), mode="edge")


__all__ = [
    "CHANNELS",
    "COEFFICIENTS",
    "LONGEST_MEMORY",
    "ObserverMemory",
    "ResidualModel",
    "kinematic_parameters",
    "noiseless_model",
]
