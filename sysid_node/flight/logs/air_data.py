"""Attitude and air data of a log at the IMU's times: the airspeed between its samples, flow angles and density."""

from __future__ import annotations

import numpy as np

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.flight.frames import euler_from_quaternion
from sysid_node.flight.logs.autopilot_log import AutopilotLog, Signal
from sysid_node.flight.logs.flown import Mask
from sysid_node.flight.logs.rates import rate_of, rate_text
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stamps

#: Attitudes and airspeeds further apart than this are not connected, s.
LONGEST_BRIDGE = 1.0

#: The angle of attack's constants are fitted to as many changes of the airspeed, or more.
_FEWEST_TO_FIT = 30

#: An airspeed that is sampled less often than this (Hz) is completed between its samples.
FAST_AIRSPEED = 25.0


def airspeed_between_samples(time: Array, force: Array, euler: Array, sampled_at: Array, airspeed: Array) -> Array:
    """The airspeed (N,) m/s at the times (N,) s of IMU samples, through the samples (M,) of an airspeed.

    ``force`` (N, 3) is the specific force, ``euler`` (N, 3) the attitude. In air that moves steadily and at a small
    angle of attack alpha, the airspeed changes as ``ax - g sin(theta) + alpha w`` with ``w = az + g cos(theta)
    cos(phi)``. Lift is proportional to the load factor n = -az / g, so that alpha = a0 + a1 n. The least-squares fit
    of a0, a1 and a constant error of the accelerometer to the airspeed's own samples gives the change between these;
    what is left over is added on a line, so that the result passes through every sample. Where the attitude is NaN,
    the change is zero. Changes over a pause of the samples or of the IMU are not fitted.
    """
    normal = force[:, 2] + GRAVITY * np.cos(euler[:, 1]) * np.cos(euler[:, 0])
    along = force[:, 0] - GRAVITY * np.sin(euler[:, 1])
    slopes = np.nan_to_num(np.column_stack([along, normal, -normal * force[:, 2] / GRAVITY, np.ones(time.size)]))
    steps = np.diff(time)[:, np.newaxis] * 0.5 * (slopes[1:] + slopes[:-1])
    gained = np.vstack([np.zeros(4), np.cumsum(steps, axis=0)])
    at_samples = np.column_stack([np.interp(sampled_at, time, column) for column in gained.T])
    weights = np.array([1.0, 0.0, 0.0, 0.0])
    fitted = _without_pause(time, sampled_at)
    if np.count_nonzero(fitted) >= _FEWEST_TO_FIT:
        changes = np.diff(at_samples, axis=0)[fitted]
        weights[1:] = np.linalg.lstsq(changes[:, 1:], np.diff(airspeed)[fitted] - changes[:, 0], rcond=None)[0]
    left_over = airspeed - at_samples @ weights
    completed: Array = gained @ weights + np.interp(time, sampled_at, left_over)
    return completed


def _without_pause(time: Array, sampled_at: Array) -> Mask:
    """Which of the M - 1 steps between samples (s) are no pause and hold none of the IMU, whose times are ``time``."""
    steps = np.diff(sampled_at)
    pauses = np.flatnonzero(np.diff(time) > LONGEST_BRIDGE)
    begun = np.searchsorted(time[pauses], sampled_at[1:]) - np.searchsorted(time[pauses + 1], sampled_at[:-1], "right")
    usable: Mask = (steps <= max(LONGEST_BRIDGE, 1.5 * float(np.median(steps)))) & (begun <= 0)
    return usable


def attitude_at(attitude: Signal, at_ns: Stamps) -> Array:
    """Euler angles (N, 3) rad at the times, between the quaternions on either side; NaN where these are far apart."""
    known = np.isfinite(attitude.values).all(axis=1)
    stamps, values = _increasing(attitude.stamp_ns[known], attitude.values[known])
    if stamps.size < 2:
        return np.full((at_ns.size, 3), np.nan)
    right = np.clip(np.searchsorted(stamps, at_ns), 1, stamps.size - 1)
    a, b = values[right - 1], values[right]
    b = b * np.sign(np.sum(a * b, axis=1, keepdims=True))
    span = (stamps[right] - stamps[right - 1]) / 1e9
    share = (at_ns - stamps[right - 1]) / 1e9 / span
    mixed = a + share[:, np.newaxis] * (b - a)
    mixed /= np.linalg.norm(mixed, axis=1, keepdims=True)
    mixed[(span > LONGEST_BRIDGE) | (share < -0.1) | (share > 1.1)] = np.nan
    return euler_from_quaternion(np.roll(mixed, -1, axis=1), "frd")


def _increasing(stamps: Stamps, values: Array) -> tuple[Stamps, Array]:
    """The samples whose stamps are later than all before them."""
    latest = np.maximum.accumulate(stamps) if stamps.size else stamps
    fresh = np.concatenate([[True], stamps[1:] > latest[:-1]]) if stamps.size else np.empty(0, bool)
    return stamps[fresh], values[fresh]


def air_data(log: AutopilotLog, imu: Signal, attitude: Array, airspeed: Signal) -> tuple[Signal, tuple[str, ...]]:
    """Airspeed, flow angles and density (N, 4) at the airspeed's times, or at the IMU's where the former are few."""
    known = np.isfinite(airspeed.values[:, 0])
    stamps, speed = _increasing(airspeed.stamp_ns[known], airspeed.values[known, 0])
    rate = rate_of(stamps)
    remarks: tuple[str, ...] = ()
    if rate < FAST_AIRSPEED and stamps.size > 1:
        at, speed = _completed(imu, attitude, stamps, speed)
        description = f"airspeed: {airspeed.source} comes at {rate_text(rate)} Hz"
        remarks = (f"{description}; between its samples it moves as the IMU says",)
    else:
        at = stamps
    density = _at(log.density, 0, at) if len(log.density) else np.full(at.size, np.nan)
    if not len(log.density):
        remarks += ("air density: not logged; the aircraft file's is used",)
    flow = [np.full(at.size, np.nan)] * 2
    if log.vanes is not None:
        flow = [_at(log.vanes, column, at) for column in (0, 1)]
    return Signal(airspeed.source, at, np.column_stack([speed, *flow, density])), remarks


def _completed(imu: Signal, attitude: Array, stamps: Stamps, speed: Array) -> tuple[Stamps, Array]:
    """The airspeed at the IMU's times between its samples, where these are no further apart than a second."""
    at, values = _increasing(imu.stamp_ns, np.column_stack([imu.values[:, :3], attitude]))
    origin = int(stamps[0])
    sampled, time = (stamps - origin) / 1e9, (at - origin) / 1e9
    completed = airspeed_between_samples(time, values[:, :3], values[:, 3:], sampled, speed)
    right = np.clip(np.searchsorted(sampled, time), 1, sampled.size - 1)
    near = (sampled[right] - sampled[right - 1] <= LONGEST_BRIDGE) & (time >= sampled[0]) & (time <= sampled[-1])
    return at[near], completed[near]


def _at(signal: Signal, column: int, at_ns: Stamps) -> Array:
    """A column at other times, on the line between its samples; its ends are held."""
    stamps, values = _increasing(signal.stamp_ns, signal.values[:, column])
    origin = int(stamps[0])
    return np.interp((at_ns - origin) / 1e9, (stamps - origin) / 1e9, values)
