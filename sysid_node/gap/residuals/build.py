"""From a flight to what the diagnosis sees of it: its windows, the sensors' noise, and the air it flew in."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.estimation.nuisances import gusty
from sysid_node.gap.flightdata import flow_angles, thrust
from sysid_node.gap.flightdata.gap_flight import Flight, thinned
from sysid_node.gap.residuals.air_motion import gusts_of, instruments_at_best, memory_of
from sysid_node.gap.residuals.flight_path_reconstruction import motion_of
from sysid_node.gap.residuals.residual_model import CHANNELS, COEFFICIENTS, LONGEST, Memory, View, bare
from sysid_node.gap.residuals.windowed_spectra import Windows
from sysid_node.sim import Simulator

#: Channels of a flight without lateral measurements.
_LONGITUDINAL = frozenset({"CL", "CD", "Cm", "V", "alpha", "theta"})

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


def view_of(simulator: Simulator, flight: Flight, seed: int = 0) -> View:
    """The flight as windows and lines, with its noise floor. Raises InputError where a signal is missing."""
    record = thinned(flight, simulator.rate)
    windows = Windows.over(len(record), simulator.rate)
    axes = np.array([flight.lateral or name in _LONGITUDINAL for name in CHANNELS])
    axes[len(COEFFICIENTS) :] &= motion_of(record) is not None
    axes[CHANNELS.index("psi")] &= bool(np.isfinite(record["psi"]).all())
    axes[[CHANNELS.index(name) for name in flight.inferred]] = False
    axes[CHANNELS.index(thrust.CHANNEL)] &= flight.metered
    silent = bare(simulator, flight, record, windows, axes, Memory(LONGEST, LONGEST))
    with ThreadPoolExecutor(1) as pool:  # meanwhile: it needs the processor more than Python's lock
        for program in silent.programs():
            pool.submit(program)
        calm = _measured_noise(silent, seed)
    instruments = instruments_at_best(calm)
    calm = replace(calm, gusts=gusts_of(calm, instruments))
    memory = memory_of(calm, instruments)
    if memory == LONGEST:
        return calm
    followed = Memory(memory, 0.0 if gusty(calm) else LONGEST)
    shorter = bare(simulator, flight, record, windows, axes, followed)
    return _measured_noise(replace(shorter, gusts=calm.gusts), seed)


def view_like(view: View, record: FlightRecord) -> View:
    """Another record of the same length, seen as this one: with its noise and its observer."""
    again = bare(view.simulator, view.flight, record, view.windows, view.axes, view.given.memory)
    return replace(again, noise=view.noise)


def _measured_noise(view: View, seed: int) -> View:
    return replace(view, noise=_noise_power(view, np.random.default_rng(seed)))


def _noise_power(view: View, random: np.random.Generator) -> Array:
    """Power (L, 12) by flying through the noise of the aircraft file again, a few times."""
    neutral = view.simulator.neutral()
    clean = view.residual(neutral)
    power = np.zeros(clean.shape[1:])
    for _ in range(_REALISATIONS):
        record = thinned(noisier(view, random), view.simulator.rate)
        again = bare(view.simulator, view.flight, record, view.windows, view.axes, view.given.memory)
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
        noisy = flow_angles.with_angles(view.simulator.aircraft, noisy, view.flight.inferred, view.flight.source)
    if not view.flight.metered:
        noisy = thrust.with_thrust(view.simulator.aircraft, noisy)
    return replace(view.flight, record=noisy)


def _jittered(view: View, random: np.random.Generator) -> dict[str, Array]:
    """Commands as other samples of the same rate might have caught them: a step falls anywhere between two samples."""
    record, aircraft = view.flight.record, view.simulator.aircraft
    period = 1.0 / view.flight.actuator_rate
    nodes = np.arange(0.0, record.duration + period, period)
    off = np.interp(record.time, nodes, period * (random.random(nodes.size) - 0.5))
    symbols = [*aircraft.control_symbols, *(["thrust"] if aircraft.throttle and view.flight.metered else [])]
    moved = [s for s in symbols if s not in view.flight.filled]
    return {s: np.interp(record.time + off, record.time, record[s]) for s in moved}
