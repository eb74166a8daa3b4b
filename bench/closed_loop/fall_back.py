"""How soon the surfaces move by the baseline gains once the identifier is killed.

    python -m bench.closed_loop.fall_back

The controller runs in a process of its own, as in flight. A second process publishes estimates of an aircraft with a
weak elevator, at 20 Hz over DDS, as the identifier does, until the controller has adapted; then it is killed (SIGKILL).
This program is the aircraft: it publishes measurements at 50 Hz, with a pitch rate that jumps by 0.02 rad/s each time.
The answering jump of the elevator's command is the gain that is flown, seen from outside. The surfaces move by the
baseline from the moment on at which the median of three jumps stays within a tenth of the way from the adapted to the
baseline's. `--page FILE` fills in the table.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.live.ros_domain import own_domain
from sysid_node.dynamics.linearised import trimmed

RATE, ESTIMATES = 50.0, 20.0  # Hz
JUMP = 0.01  # rad/s, on either side of no pitch rate
WITHIN = 0.1  # of the way between the adapted and the baseline's gain
STAYS = 10  # jumps, a fifth of a second, for which the gain stays at the baseline when it counts as flown
AFTER = 1.2  # s for which the commands are heard after a kill


def identify() -> None:
    """Publish estimates of a weak elevator until killed."""
    import rclpy  # noqa: PLC0415  # after the domain is set
    from sysid_msgs.msg import DerivativeEstimate, DerivativeEstimates, FitQuality  # noqa: PLC0415

    rclpy.init()
    node = rclpy.create_node("identifier")
    out = node.create_publisher(DerivativeEstimates, "identifier/derivatives", 10)
    known = {name: load_aircraft("cdrw").derivatives[name].value for name in ("Cm_de", "Cm_alpha")}
    values = {**known, "Cm_de": 0.6 * known["Cm_de"]}
    rows = [
        DerivativeEstimate(name=name, value=v, lower=v - 0.01, upper=v + 0.01, valid=True, status="ok")
        for name, v in values.items()
    ]
    while True:
        message = DerivativeEstimates(aircraft="cdrw", derivatives=rows)
        message.fits = [FitQuality(coefficient="Cm", r_squared=0.99)]
        message.header.stamp = node.get_clock().now().to_msg()
        out.publish(message)
        time.sleep(1.0 / ESTIMATES)


class Aircraft:
    """Measurements out, commands in; ``jumps``: s, and the elevator's answer to a jump of the pitch rate."""

    def __init__(self) -> None:
        import rclpy  # noqa: PLC0415
        from builtin_interfaces.msg import Time  # noqa: PLC0415
        from rclpy.executors import SingleThreadedExecutor  # noqa: PLC0415
        from rclpy.qos import QoSProfile, ReliabilityPolicy  # noqa: PLC0415
        from sensor_msgs.msg import Imu, JointState  # noqa: PLC0415
        from sysid_msgs.msg import AirData  # noqa: PLC0415

        rclpy.init()
        sensors = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.node = rclpy.create_node("aircraft")
        self.kinds, self.time = (Imu, AirData), Time
        self.imu = self.node.create_publisher(Imu, "imu/data", sensors)
        self.air = self.node.create_publisher(AirData, "air_data", sensors)
        self.node.create_subscription(JointState, "actuators/command", self._on_command, 50)
        self.node.create_timer(0.25 / RATE, self._fly)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.jumps: list[tuple[float, float]] = []
        self.known = load_aircraft("cdrw")
        self.level, _ = trimmed(self.known)
        self._sent: dict[tuple[int, int], float] = {}  # pitch rate by stamp
        self._last: tuple[float, float] | None = None  # pitch rate and elevator
        self._side, self._stamp = 1.0, time.time_ns()

    def _fly(self) -> None:
        """Publish what is due: stamps are even, whatever the machine does, as the gain is told by a step of time."""
        while time.time_ns() >= self._stamp + round(1e9 / RATE):
            self._stamp += round(1e9 / RATE)
            self._say(self.time(sec=self._stamp // 10**9, nanosec=self._stamp % 10**9))

    def _say(self, stamp: Any) -> None:
        make_imu, make_air = self.kinds
        self._side = -self._side
        air, imu = make_air(), make_imu()
        air.header.stamp = imu.header.stamp = stamp
        air.true_airspeed, air.angle_of_attack = self.known.reference.airspeed, self.level
        air.sideslip, air.air_density = 0.0, self.known.reference.air_density
        imu.orientation.y, imu.orientation.w = math.sin(-0.5 * self.level), math.cos(0.5 * self.level)
        imu.angular_velocity.y, imu.linear_acceleration.z = self._side * JUMP, 9.81
        self._sent[stamp.sec, stamp.nanosec] = self._side
        self.air.publish(air)
        self.imu.publish(imu)

    def _on_command(self, message: Any) -> None:
        stamp = message.header.stamp
        side = self._sent.pop((stamp.sec, stamp.nanosec), None)
        if side is None:
            return
        elevator = message.position[message.name.index("elevator")]
        if self._last is not None and self._last[0] != side:
            self.jumps.append((time.monotonic(), abs(elevator - self._last[1])))
        self._last = side, elevator

    def until(self, condition: Callable[[], bool], patience: float = 60.0) -> None:
        """Fly until the condition holds."""
        end = time.monotonic() + patience
        while not condition():
            if time.monotonic() > end:
                raise RuntimeError(f"waited for {patience:g} s; the last jumps: {self.jumps[-5:]}")
            self.executor.spin_once(timeout_sec=0.05)

    def fly(self, seconds: float) -> None:
        """Fly for so long."""
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end)

    def gain(self) -> float:
        """The median of the last jumps."""
        return float(np.median([size for _, size in self.jumps[-25:]]))


def kill_once(aircraft: Aircraft) -> tuple[float, float, float]:
    """s from the kill until the gain begins to move, and until the baseline's is flown; 1 where it changes again."""
    aircraft.fly(1.0)
    baseline = aircraft.gain()
    process = subprocess.Popen([sys.executable, "-m", "bench.closed_loop.fall_back", "--identify"])
    try:
        aircraft.until(lambda: aircraft.gain() > 1.3 * baseline)
        aircraft.fly(1.0)
    finally:
        process.kill()
    killed, adapted = time.monotonic(), aircraft.gain()
    process.wait()
    aircraft.fly(AFTER)
    moments, sizes = np.array(aircraft.jumps).T
    way = (np.median(np.lib.stride_tricks.sliding_window_view(sizes, 3), axis=1) - baseline) / (adapted - baseline)
    after = moments[2:] > killed
    since, way = moments[2:][after] - killed, way[after]
    moved = np.flatnonzero(way < 1.0 - WITHIN)
    near = np.lib.stride_tricks.sliding_window_view(np.abs(way) <= WITHIN, STAYS).all(axis=1)
    first = since[np.argmax(near)] if near.any() else math.inf
    return (since[moved[0]] if moved.size else math.inf, first, float(np.any(np.abs(way[since > first]) > WITHIN)))


def measure(kills: int) -> str:
    """The table of so many kills."""
    words = ["--ros-args", "-p", "aircraft:=cdrw"]
    aircraft = Aircraft()
    controller = subprocess.Popen([sys.executable, "-m", "sysid_node.ros.adaptive_controller", *words])
    try:
        aircraft.until(lambda: len(aircraft.jumps) > 50)
        aircraft.fly(2.0)
        found = np.array([kill_once(aircraft) for _ in range(kills)])
    finally:
        controller.terminate()
        controller.wait()
    rows = [
        [name, *(f"{x:.2f}" for x in (column.min(), np.median(column), column.max())), f"{(column <= 0.5).sum()}"]
        for name, column in zip(("the gain begins to move", "the baseline is flown"), found.T[:2], strict=True)
    ]
    load = os.getloadavg()[0]
    heads = (f"s after one of {kills} kills", "least", "median", "most", "within 0.5 s")
    again = f"In {found[:, 2].sum():.0f} of them the elevator's answer changed again within {AFTER:g} s of the kill."
    return f"{table(heads, rows)}\n\nOn {os.cpu_count()} cores with a load of {load:.0f}. {again}"


def main() -> None:
    """Print the table, or put it in the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--identify", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    if args.identify:
        identify()
    own_domain()
    publish("bench/closed_loop/fall_back.py", measure(args.kills), args.page)


if __name__ == "__main__":
    main()
