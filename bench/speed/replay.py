"""Replay against bare deserialisation: a 600 s bag of 240,000 messages, both in one run.

The bag (IMU 200 Hz, air data 100 Hz, joints 100 Hz, messages of real size) is made in a temporary folder from a linear
model of an aircraft under random surface motion, with all sensors at the centre of gravity.

    python -m bench.speed.replay [--seconds 600] [--aircraft cdrw] [--repeat 3]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import Reader
from scipy.signal import butter, cont2discrete, dlsim, sosfilt

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, Sensors
from sysid_node.api import load, replay
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.record import Array
from sysid_node.flight.streams import AirDataStream, ImuStream, JointStream, Streams, arrivals_in_stamp_order
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.settings import OnlineSettings
from sysid_node.report.files.runs.estimates_bag import write_estimates

GRAVITY = 9.81
STATES, CONTROLS = ("alpha", "q", "beta", "p", "r"), ("de", "da", "dr")


def linear_flight(aircraft: Aircraft, seconds: float, rate: float = 200.0) -> tuple[Array, Array]:
    """States alpha q beta p r and their rates (N, 10), and controls (N, 3), about straight flight at the reference."""
    g, V, rho = aircraft.geometry, aircraft.reference.airspeed, aircraft.reference.air_density
    qS = 0.5 * rho * V**2 * g.S
    hats = {"q": g.cbar / (2 * V), "p": g.b / (2 * V), "r": g.b / (2 * V)}

    def slopes(coefficient: str, names: tuple[str, ...]) -> Array:
        found = aircraft.derivatives
        key = [f"{coefficient}_{name}" for name in names]
        return np.array([found[k].value * hats.get(n, 1.0) if k in found else 0.0 for k, n in zip(key, names)])  # noqa: B905

    moment = np.array([[aircraft.inertia.Ixx, -aircraft.inertia.Ixz], [-aircraft.inertia.Ixz, aircraft.inertia.Izz]])

    def rows(names: tuple[str, ...]) -> Array:
        lift, side = slopes("CL", names), slopes("CY", names)
        roll, yaw = np.linalg.solve(moment, qS * g.b * np.stack([slopes("Cl", names), slopes("Cn", names)]))
        pitch = qS * g.cbar * slopes("Cm", names) / aircraft.inertia.Iyy
        return np.stack([-qS * lift / (aircraft.mass * V), pitch, qS * side / (aircraft.mass * V), roll, yaw])

    A, B = rows(STATES), rows(CONTROLS)
    A[0, 1] += 1.0
    A[2, 4] -= 1.0
    count = int(seconds * rate)
    rng = np.random.default_rng(3)
    lowpass = butter(2, 2.0, fs=rate, output="sos")
    controls = 0.3 * sosfilt(lowpass, rng.normal(size=(count, 3)), axis=0)
    step = cont2discrete((A, B, np.eye(5), np.zeros((5, 3))), 1.0 / rate, method="foh")
    states = dlsim((*step[:4], 1.0 / rate), controls)[1]
    return np.hstack([states, states @ A.T + controls @ B.T]), controls


def make_streams(aircraft: Aircraft, seconds: float) -> Streams:
    """The flight as messages, with sensor noise and jittered stamps."""
    rng = np.random.default_rng(4)
    motion, controls = linear_flight(aircraft, seconds)
    alpha, q, beta, p, r, alphadot, _, betadot, *_ = motion.T
    V, noise = aircraft.reference.airspeed, aircraft.noise
    at = np.arange(alpha.size) * 5_000_000 + 1_000_000_000
    slow, odd = slice(None, None, 2), slice(1, None, 2)
    imu_at, air_at, joint_at = (t + rng.integers(-200_000, 200_000, t.size) for t in (at, at[slow], at[odd]))
    force = np.column_stack([np.full(at.size, 0.3), V * (betadot + r), V * (alphadot - q) - GRAVITY])
    values = np.column_stack([force, p, q, r])
    values += rng.normal(size=values.shape) * np.repeat([noise["accel"], noise["gyro"]], 3)
    angles = np.column_stack([alpha, beta])[slow] + rng.normal(size=(air_at.size, 2)) * noise["alpha"]
    speed, density = V + noise["airspeed"] * rng.normal(size=air_at.size), np.full(air_at.size, 1.2)
    joints = {name: controls[odd, i] for i, name in enumerate(("elevator", "aileron", "rudder"))}
    joints["throttle"] = np.full(air_at.size, 0.2)
    imu, air, actuators = arrivals_in_stamp_order(imu_at, air_at, joint_at)
    return Streams(
        ImuStream(imu, values, np.zeros((at.size, 3)), "imu"),
        AirDataStream(air, np.column_stack([speed, angles, density])),
        JointStream(actuators, tuple(joints), np.column_stack(list(joints.values()))),
    )


def deserialise(bag: Path) -> None:
    """What replay is measured against: rosbags, message by message, fields into lists."""
    store = type_store()
    fields: dict[str, list[tuple[float, ...]]] = {"/imu/data": [], "/air_data": [], "/actuators": []}
    with Reader(bag) as reader:
        for connection, _, raw in reader.messages():
            m: Any = store.deserialize_cdr(raw, connection.msgtype)
            stamp = m.header.stamp.sec * 1_000_000_000 + m.header.stamp.nanosec
            if connection.topic == "/imu/data":
                f, w = m.linear_acceleration, m.angular_velocity
                fields[connection.topic].append((stamp, f.x, f.y, f.z, w.x, w.y, w.z))
            elif connection.topic == "/air_data":
                air = (m.true_airspeed, m.angle_of_attack, m.sideslip, m.air_density)
                fields[connection.topic].append((stamp, *air))
            else:
                fields[connection.topic].append((stamp, *m.position))
    for rows in fields.values():
        np.array(rows)


def best(work: Callable[[], object], repeat: int) -> float:
    """Seconds of the fastest of several runs."""
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def measure(bag: Path, aircraft: Aircraft, repeat: int, folder: Path) -> None:
    """One storage format: the parts, the whole, and the ratio."""
    settings = OnlineSettings()
    reference = best(lambda: deserialise(bag), repeat)
    streams = read_streams(bag)
    flight = load(bag, aircraft)
    done = replay(flight, judge_faults=False)
    names = iter(range(1000))

    def estimates_bag() -> None:
        path = folder / f"estimates{next(names)}"
        write_estimates(path, done.history, done.stamps_ns, aircraft="x", method="sls_rft", frame_id="imu")

    rows = {
        "rosbags, each message deserialised into fields": reference,
        "read and decode": best(lambda: read_streams(bag), repeat),
        "align": best(lambda: align_streams(aircraft, streams, settings.max_gap), repeat),
        **{
            f"replay: decode, align, identify, estimates at {rate:g} Hz": best(
                lambda rate=rate: replay(flight, {"publish_rate": rate}, judge_faults=False), repeat
            )
            for rate in (1.0, 20.0)
        },
        "estimates at 20 Hz as a bag": best(estimates_bag, repeat),
        "all files of sysid replay, report included": best(lambda: done.save(folder / "out"), 1),
    }
    for name, seconds in rows.items():
        print(f"  {name:56} {seconds:6.2f} s  {seconds / reference:5.2f}")


def main() -> None:
    """Make the bag in both formats and print a table; the last column is relative to rosbags."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--aircraft", default="cdrw")
    parser.add_argument("--repeat", type=int, default=3)
    args = parser.parse_args()
    aircraft = replace(load_aircraft(args.aircraft), sensors=Sensors())
    streams = make_streams(aircraft, args.seconds)
    messages = sum(len(stream.arrival) for stream in streams.by_topic.values())
    for storage in ("sqlite3", "mcap"):
        with tempfile.TemporaryDirectory() as name:
            write_streams(Path(name) / "bag", streams, storage)
            print(f"{storage}: {args.seconds:g} s, {messages} messages")
            measure(Path(name) / "bag", aircraft, args.repeat, Path(name))


if __name__ == "__main__":
    main()
