"""A flight that repeats itself exactly, with a known truth, as serialised messages."""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.dynamics.coefficients import Coefficients, linear_coefficient, regressors
from sysid_node.dynamics.forces import force_and_moment
from sysid_node.dynamics.lever_arm import specific_force_at, velocity_at
from sysid_node.dynamics.rigid_body import moment_for
from sysid_node.dynamics.vector import Vector

Array = NDArray[np.float64]
RATE, PERIOD = 200, 60  # Hz of the IMU's messages, s until everything repeats
AIR_EVERY, JOINTS_EVERY = 4, 4  # IMU messages for each of air data and of actuators
STAMP_AT = 4  # byte of a serialised message at which its header's stamp begins, behind the encoding
SURFACES = {"Cl": "da", "Cm": "de", "Cn": "dr"}


class Signal(NamedTuple):
    """A sum of sines that repeats after ``PERIOD``, and its derivative; (N,) each."""

    value: Array
    rate: Array


def signal(rng: np.random.Generator, size: float, mean: float = 0.0) -> Signal:
    """Twelve sines of 0.1 to 1.6 Hz at random phases, with an RMS of about ``size``."""
    time = np.arange(PERIOD * RATE) / RATE
    cycles = rng.choice(np.arange(PERIOD // 10, int(1.6 * PERIOD)), 12, replace=False)
    omega, phase = 2.0 * np.pi * cycles / PERIOD, rng.uniform(0.0, 2.0 * np.pi, 12)
    angle, part = np.outer(time, omega) + phase, size * np.sqrt(2.0 / 12)
    return Signal(mean + part * np.sin(angle).sum(axis=1), part * (np.cos(angle) * omega).sum(axis=1))


class Flown(NamedTuple):
    """What the sensors show, forward-right-down; arrays of one period."""

    force: Array  # (N, 3) m/s^2
    rates: Array  # (N, 3) rad/s
    air: Array  # (N, 3) m/s, rad, rad
    surfaces: dict[str, Array]  # (N,) rad by the control's symbol


def fly(aircraft: Aircraft, seed: int) -> Flown:
    """Prescribed rates, airspeed and flow angles, and the forces and deflections that follow from the aircraft file.

    The deflections are what the prescribed angular accelerations need. The file's noise is added, the same in each
    period, so that estimates of fading memory repeat as well.
    """
    rng, g, level = np.random.default_rng(seed), aircraft.geometry, aircraft.reference
    p, q, r = (signal(rng, size) for size in (0.5, 0.35, 0.3))
    speed, alpha, beta = (signal(rng, *one).value for one in ((0.7, level.airspeed), (0.05, 0.08), (0.05,)))
    rates, turning = Vector(p.value, q.value, r.value), Vector(p.rate, q.rate, r.rate)
    area = 0.5 * level.air_density * speed**2 * g.S
    known = regressors(
        (speed, alpha, beta), (rates.x, rates.y, rates.z), g.b, g.cbar, level.airspeed, np.ones_like(speed)
    )
    deflected = _deflections(aircraft, known, moment_for(aircraft.inertia, rates, turning), area)
    found = _coefficients(aircraft, {**known, **deflected})
    force, _ = force_and_moment(found, (np.cos(alpha), np.sin(alpha)), area, g.b, g.cbar)
    body = force.times(1.0 / aircraft.mass)
    seen = specific_force_at(body, rates, turning, Vector(*aircraft.sensors.imu))
    velocity = speed * np.array([np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)])
    u, v, w = velocity_at(tuple(velocity), (rates.x, rates.y, rates.z), aircraft.sensors.air_data)
    probe = np.sqrt(u * u + v * v + w * w)
    noise = aircraft.noise
    return Flown(
        np.column_stack([seen.x, seen.y, seen.z]) + noise["accel"] * rng.normal(size=(speed.size, 3)),
        np.column_stack([rates.x, rates.y, rates.z]) + noise["gyro"] * rng.normal(size=(speed.size, 3)),
        np.column_stack([probe, np.arctan2(w, u), np.arcsin(v / probe)])
        + np.array([noise[name] for name in ("airspeed", "alpha", "beta")]) * rng.normal(size=(speed.size, 3)),
        deflected,
    )


def _terms(aircraft: Aircraft, coefficient: str) -> list[tuple[float, str]]:
    found = [(name.partition("_"), derivative.value) for name, derivative in aircraft.derivatives.items()]
    return [(value, regressor) for (of, _, regressor), value in found if of == coefficient]


def _coefficients(aircraft: Aircraft, known: dict[str, Array]) -> Coefficients:
    zero = np.zeros_like(known["0"])
    return Coefficients(*(linear_coefficient(_terms(aircraft, one), known, zero) for one in COEFFICIENTS))


def _deflections(aircraft: Aircraft, known: dict[str, Array], moment: Vector, area: Array) -> dict[str, Array]:
    """The deflections (N,) by symbol that give a moment (N m)."""
    g = aircraft.geometry
    still = _coefficients(aircraft, {**known, **dict.fromkeys(SURFACES.values(), np.zeros_like(area))})
    needed = np.array([moment.x / (area * g.b), moment.y / (area * g.cbar), moment.z / (area * g.b)])
    needed -= np.array([still.Cl, still.Cm, still.Cn])
    effect = np.array(
        [[dict(map(reversed, _terms(aircraft, c))).get(s, 0.0) for s in SURFACES.values()] for c in SURFACES]
    )
    return dict(zip(SURFACES.values(), np.linalg.solve(effect, needed), strict=True))


class Messages(NamedTuple):
    """The serialised messages of one period in the order in which they are sent."""

    topics: list[int]  # 0 imu, 1 air data, 2 actuators
    ticks: list[int]  # IMU periods since the period's start
    data: list[bytearray]


def serialised(aircraft: Aircraft, flown: Flown) -> Messages:
    """The flight as ROS messages, forward-left-up; ``stamped`` gives them their time."""
    from rclpy.serialization import serialize_message  # noqa: PLC0415  # after the domain is set
    from sensor_msgs.msg import Imu, JointState  # noqa: PLC0415
    from sysid_msgs.msg import AirData  # noqa: PLC0415

    controls = {control.symbol: name for name, control in aircraft.controls.items()}
    found = Messages([], [], [])
    for tick in range(PERIOD * RATE):
        air, imu, joints = AirData(), Imu(), JointState()
        air.true_airspeed, air.angle_of_attack, air.sideslip = flown.air[tick].tolist()
        air.air_density = aircraft.reference.air_density
        (force, turning), flip = (flown.force[tick], flown.rates[tick]), (1.0, -1.0, -1.0)
        for axis, sign, f, w in zip("xyz", flip, force.tolist(), turning.tolist(), strict=True):
            setattr(imu.linear_acceleration, axis, sign * f)
            setattr(imu.angular_velocity, axis, sign * w)
        joints.name = [*(controls[symbol] for symbol in flown.surfaces), "throttle"]
        joints.position = [*(float(one[tick]) for one in flown.surfaces.values()), 0.0]
        due = [(1, air)] if tick % AIR_EVERY == 0 else []
        due += [(2, joints)] if tick % JOINTS_EVERY == 0 else []
        for topic, message in (*due, (0, imu)):
            found.topics.append(topic)
            found.ticks.append(tick)
            found.data.append(bytearray(serialize_message(message)))
    return found


def stamped(data: bytearray, stamp_ns: int) -> bytes:
    """The message with another stamp."""
    struct.pack_into("<iI", data, STAMP_AT, *divmod(stamp_ns, 10**9))
    return bytes(data)


def stamp_of(data: bytes) -> int:
    """The stamp (ns) of a serialised message's header."""
    seconds, rest = struct.unpack_from("<iI", data, STAMP_AT)
    return int(seconds) * 10**9 + int(rest)
