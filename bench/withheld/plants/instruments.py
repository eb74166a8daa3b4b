"""What the bag holds of a flight: instruments of real parts, each with its rate, noise, steps, clock, and errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from bench.withheld.plants.motion import GRAVITY, Effects, Triple
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.streams import AirDataStream, Arrival, ImuStream, JointStream, Streams

Array = NDArray[np.float64]

_START_NS = 1_767_225_600_000_000_000
_ACCELERATION, _RATE, _ANGLE, _SPEED = 16 * GRAVITY / 2**15, np.deg2rad(2000.0) / 2**15, 2 * np.pi / 2**14, 0.01
_STEPS = np.array([_ACCELERATION] * 3 + [_RATE] * 3 + [0.0] * 3 + [_SPEED] + [_ANGLE] * 2)
_COLUMNS = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi", "V", "alpha", "beta")


@dataclass(frozen=True)
class Suite:
    """Rates (Hz), jitter (s rms) and latency (s) of a flight computer's logs."""

    imu: float
    air: float
    actuators: float
    jitter: float
    latency: float


SUITES = {
    "research": Suite(200.0, 100.0, 100.0, 0.0002, 0.002),
    "autopilot": Suite(250.0, 50.0, 50.0, 0.0005, 0.005),
    "small": Suite(100.0, 50.0, 50.0, 0.001, 0.01),
    "fast": Suite(400.0, 100.0, 200.0, 0.0002, 0.002),
    "fifty": Suite(50.0, 50.0, 50.0, 0.0005, 0.005),
    "slow": Suite(25.0, 25.0, 25.0, 0.0005, 0.005),
    "ten": Suite(10.0, 10.0, 10.0, 0.0005, 0.005),
}

#: Those of small aircraft.
USUAL = ("research", "autopilot", "small")


@dataclass(frozen=True)
class Log:
    """A flight at the plant's rate: time (N,) s; force, turning, rates, euler, flow, turned (N, 3), density (N,)."""

    time: Array
    force: Array
    turning: Array
    rates: Array
    euler: Array
    flow: Array
    turned: Array
    density: Array
    commands: Array  # (N, controls + 1), thrust last
    cg: Triple


def readings(log: Log, aircraft: Aircraft, effects: Effects) -> Array:
    """Noiseless readings (N, 12) at the plant's rate, with the errors of the instruments but for their clocks."""
    imu = np.array(aircraft.sensors.imu) + _xyz(effects.get("imu_lever_arm", {}), "xyz") - log.cg
    probe = np.array(aircraft.sensors.air_data) + _xyz(effects.get("vane_lever_arm", {}), "xyz") - log.cg
    force = log.force + np.cross(log.turning, imu) + np.cross(log.rates, np.cross(log.rates, imu))
    shake, nod = _mode(log, effects.get("structural_mode", {}))
    force[:, 2] += shake
    rates = log.rates.copy()
    rates[:, 1] += nod
    turn = _xyz(effects.get("imu_misalignment", {}), ("roll", "pitch", "yaw"))
    scale, bias = effects.get("imu_scale", {}), effects.get("imu_bias", {})
    force = (force - np.cross(turn, force)) * (1.0 + _xyz(scale, _COLUMNS[:3])) + _xyz(bias, _COLUMNS[:3])
    rates = (rates - np.cross(turn, rates)) * (1.0 + _xyz(scale, _COLUMNS[3:6])) + _xyz(bias, _COLUMNS[3:6])
    air = _air(log, probe, effects)
    euler = np.unwrap(log.euler, axis=0)
    return _saturated(np.column_stack([force, rates, euler, air]), effects.get("saturation", {}))


def _xyz(values: Mapping[str, float], names: tuple[str, ...] | str) -> Array:
    return np.array([values.get(name, 0.0) for name in names])


def _air(log: Log, probe: Array, effects: Effects) -> Array:
    """Airspeed, alpha, beta (N, 3) as the probe has them."""
    flow = log.flow + np.cross(log.turned, probe)
    forward = np.hypot(flow[:, 0], flow[:, 2])
    truth = np.column_stack(
        [np.hypot(forward, flow[:, 1]), np.arctan2(flow[:, 2], flow[:, 0]), np.arctan2(flow[:, 1], forward)]
    )
    lag = effects.get("air_data_lag", {}).get("time_constant", 0.0)
    if lag:
        decay = np.exp(-(log.time[1] - log.time[0]) / lag)
        truth = lfilter([1.0 - decay], [1.0, -decay], truth, axis=0, zi=decay * truth[:1])[0]
    scale = effects.get("vane_scale", {})
    factors = np.array([1.0 + effects.get("airspeed_scale", {}).get("error", 0.0), 1.0, 1.0])
    factors[1:] += _xyz(scale, ("alpha", "beta"))
    return np.asarray(truth * factors + [0.0, *_xyz(effects.get("vane_bias", {}), ("alpha", "beta"))])


def _mode(log: Log, values: Mapping[str, float]) -> tuple[Array, Array]:
    """What an elastic mode adds to az and q (N,): its own acceleration and slope, driven by the force along z."""
    if not values:
        return np.zeros(log.time.size), np.zeros(log.time.size)
    omega, damping = 2.0 * np.pi * values["frequency"], values.get("damping", 0.05)
    step = float(log.time[1] - log.time[0])
    b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * damping * omega, omega**2]), step, "bilinear")
    off = log.force[:, 2] - log.force[0, 2]
    acceleration = lfilter(np.ravel(b), a, off)
    speed = np.cumsum(acceleration) * step
    return values["gain"] * acceleration, values["slope"] * speed


def _saturated(seen: Array, values: Mapping[str, float]) -> Array:
    """One reading clipped about its first value; on nobody's list."""
    for name, share in values.items():
        column = seen[:, _COLUMNS.index(name)]
        reach = share * np.abs(column - column[0]).max()
        column[:] = np.clip(column, column[0] - reach, column[0] + reach)
    return seen


def record(
    log: Log, seen: Array, aircraft: Aircraft, effects: Effects, suite: Suite, noise: float, random: np.random.Generator
) -> Streams:
    """Messages of a flight whose noiseless readings (N, 12) are given; ``noise`` times the aircraft file's sigmas."""
    spreads = noise * np.array([aircraft.noise[n] for n in ("accel", "gyro", "attitude", "airspeed", "alpha", "beta")])
    sigma = np.repeat(spreads, [3, 3, 3, 1, 1, 1])
    span = float(log.time[-1])
    times = [_instants(rate, span, suite.jitter, random) for rate in (suite.imu, suite.air, suite.actuators)]
    late = [effects.get(f"{topic}_delay", {}).get("delay", 0.0) for topic in ("imu", "air_data", "actuator_stamp")]
    imu, air = (_sampled(log.time, seen, t - d, sigma, random) for t, d in zip(times[:2], late[:2], strict=True))
    density = np.interp(times[1], log.time, log.density)
    given = np.column_stack([np.interp(times[2] - late[2], log.time, column) for column in log.commands.T])
    arrivals = _arrivals(times, suite.latency, random)
    joints, positions = _joints(aircraft, given)
    return Streams(
        ImuStream(arrivals[0], imu[:, :6], imu[:, 6:9], "imu"),
        AirDataStream(arrivals[1], np.column_stack([air[:, 9:], density])),
        JointStream(arrivals[2], joints, positions),
        aircraft.name,
    )


def _sampled(time: Array, seen: Array, at: Array, sigma: Array, random: np.random.Generator) -> Array:
    exact = np.column_stack([np.interp(at, time, column) for column in seen.T])
    noisy = exact + sigma * random.standard_normal(exact.shape)
    steps = np.where(_STEPS > 0.0, _STEPS, 1.0)
    return np.where(_STEPS > 0.0, np.round(noisy / steps) * steps, noisy)


def _instants(rate: float, span: float, jitter: float, random: np.random.Generator) -> Array:
    regular = np.arange(int(span * rate + 1e-9) + 1) / rate
    off = np.clip(jitter * random.standard_normal(regular.size), -0.2 / rate, 0.2 / rate)
    return np.asarray(np.clip(regular + off, 0.0, span))


def _arrivals(times: list[Array], latency: float, random: np.random.Generator) -> list[Arrival]:
    stamps = [_START_NS + np.round(1e9 * t).astype(np.int64) for t in times]
    logged = [s + np.round(1e9 * latency * (0.5 + random.random(s.size))).astype(np.int64) for s in stamps]
    logged = [np.maximum.accumulate(moments) for moments in logged]
    every = np.concatenate(logged)
    place = np.empty(every.size, np.int64)
    place[np.argsort(every, kind="stable")] = np.arange(every.size)
    places = np.split(place, np.cumsum([s.size for s in stamps])[:-1])
    return [Arrival(*parts) for parts in zip(stamps, logged, places, strict=True)]


def _joints(aircraft: Aircraft, given: Array) -> tuple[tuple[str, ...], Array]:
    """Joint names and positions from controls and thrust: the aircraft file's map turned round."""
    controls = list(aircraft.controls.values())
    names = tuple(dict.fromkeys(joint for c in controls for joint in c.joints))
    scales = np.array([[c.joints.get(name, 0.0) for name in names] for c in controls])
    positions = (given[:, :-1] - [c.offset for c in controls]) @ np.linalg.pinv(scales).T
    throttle = aircraft.throttle
    if throttle is None:
        return names, np.asarray(positions)
    return (*names, throttle.joint), np.column_stack([positions, given[:, -1] / (throttle.max_thrust or 1.0)])
