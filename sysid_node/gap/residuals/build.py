"""From a flight to its residual model: windows, the power of the sensors' noise, and the motion of the air."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import LONGITUDINAL, LONGITUDINAL_SIGNALS
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata import thrust
from sysid_node.gap.flightdata.gap_flight import GapFlight, resampled
from sysid_node.gap.flightdata.inferred_flow import filter_steps
from sysid_node.gap.flightdata.time_scales import highest_frequency
from sysid_node.gap.residuals.air_motion import (
    LONGEST_MEMORY,
    best_instrument_parameters,
    gust_speed,
    is_gusty,
    observer_memory,
)
from sysid_node.gap.residuals.flight_path_reconstruction import READINGS, motion_of
from sysid_node.gap.residuals.noise_gain import NoiseGain, gain_from, noisy_parameters
from sysid_node.gap.residuals.predictions import CHANNELS, ObserverMemory, PredictionInputs
from sysid_node.gap.residuals.residual_model import Measurement, ResidualModel, joined
from sysid_node.gap.residuals.sensor_noise import with_added_noise
from sysid_node.gap.residuals.windowed_spectra import Complex, Windows
from sysid_node.sim import Simulator
from sysid_node.sim.model.layout import Scalar
from sysid_node.sim.prediction.accelerations import Accelerations
from sysid_node.sim.prediction.coefficients import COEFFICIENTS, coefficients
from sysid_node.sim.prediction.signals import signals_of

#: Channels of a flight without lateral measurements.
_LONGITUDINAL = frozenset({*LONGITUDINAL, *LONGITUDINAL_SIGNALS})

#: Realisations of the sensors' noise over which its power is averaged.
_REALISATIONS = 4

#: Least power of the sensors' noise, in the channels' units squared.
_LEAST_NOISE = 1e-18

#: Lengths (samples) to which flights are padded; longer flights to multiples of ``_BLOCK``. Each length needs another
#: set of programs, which takes more than a minute to compile; a prediction of thousands of samples takes milliseconds.
_LENGTHS, _BLOCK = (1500, 3000), 6000

#: Channels of the flow angles.
_VANES = [CHANNELS.index("alpha"), CHANNELS.index("beta")]

#: Columns of the linear and angular accelerations that the inertial instruments measured.
_ACCELERATIONS = (("ax", "ay", "az"), ("p_rate", "q_rate", "r_rate"))

_measured_coefficients = jax.jit(coefficients)


def residual_model_of(
    simulator: Simulator, flight: GapFlight, seed: int = 0, *, will_be_fitted: bool = False
) -> ResidualModel:
    """The flight's residual model, with the power of its sensors' noise and the motion of the air.

    Raises InputError where a signal is missing. ``seed`` is that of the noise's realisations. For a model that
    ``will_be_fitted`` all programs of slopes are compiled meanwhile; otherwise each is when it is first needed.
    """
    record = resampled(flight, simulator.rate)
    highest = highest_frequency(simulator.aircraft, lateral=flight.lateral)
    windows = Windows.over(len(record), simulator.rate, highest=highest)
    axes, noisy = _measured_channels(flight, record), _with_added_noise(simulator, flight, seed)
    silent = noiseless_model(simulator, flight, record, windows, axes, ObserverMemory(LONGEST_MEMORY, LONGEST_MEMORY))
    with ThreadPoolExecutor(1) as pool:  # compiling needs the processor more than Python's lock
        for program in silent.programs() if will_be_fitted else ():
            pool.submit(program)
        calm = _with_measured_noise(silent, noisy)
    instruments = best_instrument_parameters(calm)
    calm = replace(calm, gusts=gust_speed(calm, instruments), instruments=instruments)
    memory = observer_memory(calm, instruments)
    if memory == LONGEST_MEMORY:
        return calm
    followed = ObserverMemory(memory, 0.0 if is_gusty(calm) else LONGEST_MEMORY)
    shown = _without_drag(axes) if "alpha" in flight.inferred and is_gusty(calm) else axes
    shorter = noiseless_model(simulator, flight, record, windows, shown, followed)
    known = _with_measured_noise(replace(shorter, gusts=calm.gusts, instruments=instruments), noisy)
    return replace(known, gain=_noise_gain(known, noisy)) if followed.vane == 0.0 else known


def residual_model_like(model: ResidualModel, flight: GapFlight) -> ResidualModel:
    """The residual model of another flight of the same length, with the noise and the observer of this one."""
    record = resampled(flight, model.simulator.rate)
    again = noiseless_model(model.simulator, flight, record, model.windows, model.axes, model.inputs.memory)
    return replace(again, noise=model.noise)


def noiseless_model(
    simulator: Simulator,
    flight: GapFlight,
    record: FlightRecord,
    windows: Windows,
    axes: NDArray[np.bool_],
    memory: ObserverMemory,
) -> ResidualModel:
    """The residual model of a record whose sensors' noise is not known: its power is one."""
    inputs, series = _inputs(simulator, flight, record, memory, axes[_VANES])
    measurement = Measurement(record, windows, series, windows.transform(series), axes)
    return ResidualModel(simulator, flight, measurement, inputs, np.ones((1, len(CHANNELS))))


def _measured_channels(flight: GapFlight, record: FlightRecord) -> NDArray[np.bool_]:
    """Which channels (12,) were measured."""
    axes = np.array([flight.lateral or name in _LONGITUDINAL for name in CHANNELS])
    axes[len(COEFFICIENTS) :] &= motion_of(record) is not None
    axes[CHANNELS.index("psi")] &= bool(np.isfinite(record["psi"]).all())
    axes[[CHANNELS.index(name) for name in flight.inferred]] = False
    axes[CHANNELS.index(thrust.THRUST_CHANNEL)] &= flight.metered
    return axes


def _without_drag(axes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which channels (12,) are compared where gusts turn the lift by angles that no vane measures."""
    return np.asarray(axes & (np.array(CHANNELS) != "CD"))


def _with_added_noise(simulator: Simulator, flight: GapFlight, seed: int) -> list[FlightRecord]:
    """The flight's record with a few realisations of its sensors' noise added, one each."""
    random = np.random.default_rng(seed)
    noisy = (with_added_noise(simulator.aircraft, flight, random) for _ in range(_REALISATIONS))
    return [resampled(again, simulator.rate) for again in noisy]


def _with_measured_noise(model: ResidualModel, noisy: Sequence[FlightRecord]) -> ResidualModel:
    return replace(model, noise=_noise_power(model, noisy))


def _noise_power(model: ResidualModel, noisy: Sequence[FlightRecord]) -> Array:
    """Power (L, 12) of the sensors' noise in the residual, from records with a realisation of it added to each."""
    simulator, neutral = model.simulator, model.simulator.neutral()
    clean = model.residual(neutral)
    power = np.zeros(clean.shape[1:])
    for record in noisy:
        again = noiseless_model(simulator, model.flight, record, model.windows, model.axes, model.inputs.memory)
        power += (np.abs(again.residual(neutral) - clean) ** 2).mean(axis=0) / len(noisy)
    return np.maximum(model.windows.smoothed(power), _LEAST_NOISE)


def _noise_gain(model: ResidualModel, noisy: Sequence[FlightRecord]) -> NoiseGain:
    """How the power of the noise depends on the parameters, from records with a realisation of it added to each."""
    simulator, neutral = model.simulator, model.simulator.neutral()
    indices = noisy_parameters(simulator.names)
    clean = _residual_and_slopes(model, indices)
    parts = []
    for record in noisy:
        again = noiseless_model(simulator, model.flight, record, model.windows, model.axes, model.inputs.memory)
        parts.append(_residual_and_slopes(again, indices) - clean)
    power = (np.abs(clean[..., 0]) ** 2).mean(axis=0)
    return gain_from(model.windows, np.concatenate(parts), indices, neutral, power)


def _residual_and_slopes(model: ResidualModel, indices: NDArray[np.intp]) -> Complex:
    """The residual, and its slopes with respect to J parameters (W, L, 12, J + 1), at the file's parameters."""
    neutral = model.simulator.neutral()
    slopes = model.slopes(neutral, indices.tolist())
    return np.concatenate([model.residual(neutral)[..., None], -slopes], axis=3)


def _inputs(
    simulator: Simulator,
    flight: GapFlight,
    record: FlightRecord,
    memory: ObserverMemory,
    vanes: NDArray[np.bool_],
) -> tuple[PredictionInputs, Array]:
    """What predictions take from a record of a flight, padded, and the measured channels (N, 12).

    ``vanes`` (2,) were measured.
    """
    signals, motion = signals_of(simulator, record, flight.begin), motion_of(record)
    missing = padded_length(len(record)) - len(record)
    signals, motion = (jax.tree.map(lambda x: _padded(x, missing), parts) for parts in (signals, motion))
    accelerations = [Vector(*(_padded(record[name], missing) for name in names)) for names in _ACCELERATIONS]
    forces = joined(_measured_coefficients(simulator.model, signals, Accelerations(*accelerations)), len(record))
    empty = jnp.zeros((len(record) + missing, len(READINGS)))
    read = empty if motion is None else jnp.hstack([motion.air, motion.attitude])
    if flight.history is not None and motion is not None:
        length = len(record) + missing
        steps = filter_steps(simulator.aircraft, flight.history, record, simulator.rate, length)
        motion = motion._replace(inference=steps)
    memories, measured = jax.tree.map(jnp.asarray, memory), jnp.asarray(vanes, float)
    inputs = PredictionInputs(signals, motion, memories, measured, jnp.asarray(simulator.step))
    return inputs, np.concatenate([forces, np.asarray(read)[: len(record)]], axis=1)


def padded_length(samples: int) -> int:
    """The length to which a flight of so many samples is padded, so that few programs are compiled."""
    return next((length for length in _LENGTHS if samples <= length), -(-samples // _BLOCK) * _BLOCK)


def _padded(series: Scalar | Array, missing: int) -> Scalar:
    """A series (N, ...) with its last value repeated so many times."""
    return jnp.pad(jnp.asarray(series), [(0, missing)] + [(0, 0)] * (series.ndim - 1), mode="edge")
