"""From a flight to what the diagnosis sees of it: its windows, the sensors' noise, and the air it flew in."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.names import LONGITUDINAL, LONGITUDINAL_SIGNALS
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata import flow_angles, thrust
from sysid_node.gap.flightdata.gap_flight import GapFlight, resampled
from sysid_node.gap.residuals.air_motion import best_instrument_parameters, gust_speed, is_gusty, observer_memory
from sysid_node.gap.residuals.flight_path_reconstruction import motion_of
from sysid_node.gap.residuals.residual_model import (
    CHANNELS,
    COEFFICIENTS,
    LONGEST_MEMORY,
    ObserverMemory,
    ResidualModel,
    noiseless_model,
)
from sysid_node.gap.residuals.windowed_spectra import Windows
from sysid_node.sim import Simulator

#: Channels of a flight without lateral measurements.
_LONGITUDINAL = frozenset({*LONGITUDINAL, *LONGITUDINAL_SIGNALS})

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


def residual_model_of(simulator: Simulator, flight: GapFlight, seed: int = 0) -> ResidualModel:
    """The flight as windows and lines, with its noise floor. Raises InputError where a signal is missing."""
    record = resampled(flight, simulator.rate)
    windows = Windows.over(len(record), simulator.rate)
    axes = np.array([flight.lateral or name in _LONGITUDINAL for name in CHANNELS])
    axes[len(COEFFICIENTS) :] &= motion_of(record) is not None
    axes[CHANNELS.index("psi")] &= bool(np.isfinite(record["psi"]).all())
    axes[[CHANNELS.index(name) for name in flight.inferred]] = False
    axes[CHANNELS.index(thrust.THRUST_CHANNEL)] &= flight.metered
    silent = noiseless_model(simulator, flight, record, windows, axes, ObserverMemory(LONGEST_MEMORY, LONGEST_MEMORY))
    with ThreadPoolExecutor(1) as pool:  # meanwhile: it needs the processor more than Python's lock
        for program in silent.programs():
            pool.submit(program)
        calm = _measured_noise(silent, seed)
    instruments = best_instrument_parameters(calm)
    calm = replace(calm, gusts=gust_speed(calm, instruments))
    memory = observer_memory(calm, instruments)
    if memory == LONGEST_MEMORY:
        return calm
    followed = ObserverMemory(memory, 0.0 if is_gusty(calm) else LONGEST_MEMORY)
    shorter = noiseless_model(simulator, flight, record, windows, axes, followed)
    return _measured_noise(replace(shorter, gusts=calm.gusts), seed)


def residual_model_like(model: ResidualModel, record: FlightRecord) -> ResidualModel:
    """Another record of the same length, seen as this one: with its noise and its observer."""
    again = noiseless_model(model.simulator, model.flight, record, model.windows, model.axes, model.given.memory)
    return replace(again, noise=model.noise)


def _measured_noise(model: ResidualModel, seed: int) -> ResidualModel:
    return replace(model, noise=_noise_power(model, np.random.default_rng(seed)))


def _noise_power(model: ResidualModel, random: np.random.Generator) -> Array:
    """Power (L, 12) by flying through the noise of the aircraft file again, a few times."""
    neutral = model.simulator.neutral()
    clean = model.residual(neutral)
    power = np.zeros(clean.shape[1:])
    for _ in range(_REALISATIONS):
        record = resampled(with_added_noise(model, random), model.simulator.rate)
        again = noiseless_model(model.simulator, model.flight, record, model.windows, model.axes, model.given.memory)
        power += (np.abs(again.residual(neutral) - clean) ** 2).mean(axis=0) / _REALISATIONS
    return np.maximum(model.windows.smoothed(power), 1e-18)


def with_added_noise(model: ResidualModel, random: np.random.Generator) -> GapFlight:
    """The flight with the sensors' noise added once more, as strong in the band as each topic's rate makes it."""
    record, sigmas = model.flight.record, model.simulator.aircraft.noise
    own_rate = 1.0 / float(np.median(np.diff(record.time)))
    columns = dict(record.columns)
    for sensor, names in _NOISE.items():
        rate = model.flight.imu_rate if sensor in {"accel", "gyro", "attitude"} else model.flight.air_rate
        spread = sigmas[sensor] * np.sqrt(own_rate / min(rate, own_rate))
        for name in names:
            if name in columns and name not in model.flight.filled:
                columns[name] = columns[name] + spread * random.standard_normal(len(record))
    columns |= _jittered(model, random)
    noisy = replace(record, columns=columns)
    if model.flight.inferred:
        noisy = flow_angles.with_inferred_angles(
            model.simulator.aircraft, noisy, model.flight.inferred, model.flight.source
        )
    if not model.flight.metered:
        noisy = thrust.with_inferred_thrust(model.simulator.aircraft, noisy)
    return replace(model.flight, record=noisy)


def _jittered(model: ResidualModel, random: np.random.Generator) -> dict[str, Array]:
    """Commands as other samples of the same rate might have caught them: a step falls anywhere between two samples."""
    record, aircraft = model.flight.record, model.simulator.aircraft
    period = 1.0 / model.flight.actuator_rate
    nodes = np.arange(0.0, record.duration + period, period)
    off = np.interp(record.time, nodes, period * (random.random(nodes.size) - 0.5))
    symbols = [*aircraft.control_symbols, *(["thrust"] if aircraft.throttle and model.flight.metered else [])]
    moved = [s for s in symbols if s not in model.flight.filled]
    return {s: np.interp(record.time + off, record.time, record[s]) for s in moved}
