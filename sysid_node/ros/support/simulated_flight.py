"""The class of the node `flight_simulator`: an aircraft that flies in real time, or faster, flown over topics."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Vector3
from numpy.typing import NDArray
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from sysid_msgs.msg import AirData

from sysid_node.control.law.allocation import Allocation
from sysid_node.errors import InputError
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.frames import quaternion_from_euler
from sysid_node.flight.live.arrivals import LATE
from sysid_node.flight.live.monitor import Durations
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.parameter import AIRCRAFT, NodeParameter
from sysid_node.ros.support.conversion import NANOSECONDS, header, stamp_message
from sysid_node.ros.support.loop_node import COMMAND, LATEST, LoopNode
from sysid_node.sim import EFFECTS, Simulator, trim_flight
from sysid_node.sim.flying import live
from sysid_node.sim.flying.live import LiveConditions, LiveReading
from sysid_node.sim.flying.pace import Pace
from sysid_node.sim.signals.dryden import INTENSITIES

PARAMETERS = (
    AIRCRAFT,
    NodeParameter(
        "effects",
        "actuator_lag:time_constant=0.05",
        "",
        "What makes the aircraft differ from its file: name:key=value, several with a space between. Change in flight. "
        "It replaces what the file states of the same; the default does not where the file states actuator_lag.",
        "To let something fail, add it to the others: actuator_lag:time_constant=0.05 "
        "control_effectiveness_loss:elevator=0.6 (docs: Effects).",
    ),
    NodeParameter(
        "rate",
        200.0,
        "Hz",
        "Samples a second of flight: IMU, air data and actuators alike.",
        "Down on a slow machine.",
        lower=20.0,
        upper=1000.0,
    ),
    NodeParameter(
        "speed",
        1.0,
        "",
        "How many times as fast as real time it flies; other than 1 it publishes /clock.",
        "Up to save time, with use_sim_time in the other nodes.",
        lower=0.05,
        upper=50.0,
    ),
    NodeParameter(
        "turbulence",
        "none",
        "",
        "Dryden turbulence.",
        "To see the loop at work in rough air.",
        choices=tuple(INTENSITIES),
    ),
    NodeParameter(
        "surfaces",
        "measured",
        "",
        "What the topic actuators carries: the surfaces' measured positions, or the autopilot's commands.",
        "commanded to fly as most small aircraft do, which measure no surface.",
        choices=("measured", "commanded"),
    ),
    NodeParameter("noise", 1.0, "", "Sensor noise, in that of the aircraft file.", "0 for ideal sensors.", 0.0, 20.0),
    NodeParameter("seed", 0.0, "", "Of noise and turbulence.", "For another flight.", 0.0, 1e9),
)
COMMAND_AGE = 0.2  # s without a command, beyond which diagnostics warn
LIVE = frozenset({"effects"})
POSE_EVERY = 10  # samples
ENU_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


class FlightSimulator(LoopNode):
    """``config/flight_simulator.yaml`` explains its parameters. Raises InputError on wrong ones."""

    def __init__(self) -> None:
        super().__init__("flight_simulator", PARAMETERS, LIVE)
        values = self.values
        self._simulator = Simulator(self.aircraft, values["rate"])
        self._trim = trim_flight(self._simulator)
        self._theta = self._first_effects(values["effects"])
        self._air = LiveConditions(values["turbulence"], noise=values["noise"], seed=int(values["seed"]))
        self._actuation, self._allocation = Actuation.of(self.aircraft), Allocation.of(self.aircraft)
        self._steps, self._commands, self._refused = Durations(), 0, 0
        self._refusal = ""  # why commands were refused since the last report
        self._commanded = -math.inf  # s, time.monotonic of the last command
        self._open_topics()
        self._begin()
        live.step(self._simulator, self._flight, self._command)  # the first step compiles the program
        self._start_ns = self.get_clock().now().nanoseconds if values["speed"] == 1.0 else time.time_ns()
        self._pace = Pace(time.monotonic(), self._simulator.step, values["speed"])
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.every(0.5 / (values["rate"] * values["speed"]), self._on_time)
        self.get_logger().info(f"flies {self.aircraft.name!r} at {values['rate']:g} Hz")

    def _begin(self) -> None:
        """Begin a flight in trim, with the present effects."""
        self._flight = live.start(self._simulator, self._trim, self._air, self._theta)
        self._command: list[float] = self._trim.command.tolist()
        self._reached = self._command  # the command that the aircraft reached with the present sample
        self._diverged = ""  # why the flight is none any more
        self._reported_skip = 0.0  # s that were not flown and have been reported

    def _on_reset(self, _: Any, response: Any) -> Any:
        """Begin anew; the stamps go on."""
        gone = time.monotonic() - self._pace.begun
        self._start_ns += round(NANOSECONDS * gone * self.values["speed"])
        self._begin()
        self._pace = Pace(time.monotonic(), self._simulator.step, self.values["speed"])
        self.get_logger().warning("flies again from level flight, on request")
        response.success, response.message = True, "flies again from level flight"
        return response

    def _open_topics(self) -> None:
        self._imu = self.create_publisher(Imu, IMU, 50)
        self._air_data = self.create_publisher(AirData, AIR_DATA, 50)
        self._actuators = self.create_publisher(JointState, ACTUATORS, 50)
        self._pose = self.create_publisher(PoseStamped, "pose", 10)
        self._sim_time = self.create_publisher(ClockMessage, "/clock", 10) if self.values["speed"] != 1.0 else None
        self.hear(JointState, COMMAND, self._on_command, LATEST)

    def _first_effects(self, effects: str) -> NDArray[np.float64]:
        """The parameters (P,) of the parameter ``effects``, whose default gives way to servos that the file states."""
        usual = effects == PARAMETERS[1].default and "actuator_lag" in self.aircraft.effects
        unsent = [name for name in self.aircraft.effect_values() if EFFECTS[name].station == "clock"]
        if unsent:
            self.get_logger().warning(f"the aircraft file's {', '.join(unsent)} are left out: stamps are those of now")
        return live.vector(self._simulator, [] if usual else effects.split())

    def changed(self, values: Mapping[str, Any]) -> None:
        """Take new effects; they act from the next sample on."""
        if "effects" in values:
            if not isinstance(values["effects"], str):
                raise InputError(f"effects {values['effects']!r}: expected a string")
            self._theta = self._flight.theta = live.vector(self._simulator, values["effects"].split())
            self.get_logger().info(f"effects: {values['effects'] or 'none'}")

    def words(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Whether it flies, keeps up with the clock, and how long a step takes."""
        p50, p99 = self._steps.percentiles()
        flown = self._flight.samples * self._simulator.step
        behind = self._pace.tell()
        values = {
            "flight time (s)": flown,
            "step p50 (us)": 1e6 * p50,
            "step p99 (us)": 1e6 * p99,
            "commands": self._commands,
            "commands refused": self._refused,
            "behind the clock at most (ms)": 1e3 * behind,
            "not flown (s)": self._pace.skipped,
        }
        skipped, self._reported_skip = self._pace.skipped - self._reported_skip, self._pace.skipped
        troubles = [f"{skipped:.1f} s were not flown, the machine is too slow"] if skipped else []
        if behind > LATE:
            troubles.append(f"up to {1e3 * behind:.0f} ms behind the clock")
        if self._diverged:
            return DiagnosticStatus.ERROR, f"{flown:.0f} s flown; {self._diverged_words()}", values
        silence = time.monotonic() - self._commanded
        if not self._commands:
            troubles.append(f"nobody flies it: no commands on {self.inputs[COMMAND].name}")
        troubles += [f"{subject}: {text}" for subject, text in self.present.items()]
        if self._commands and silence > COMMAND_AGE:
            troubles.append(f"no commands on {self.inputs[COMMAND].name} for {silence:.1f} s: the last one is held")
        line = "; ".join([f"{flown:.0f} s flown", *troubles])
        return DiagnosticStatus.WARN if troubles else DiagnosticStatus.OK, line, values

    def conditions(self) -> Mapping[str, str]:
        """A flight that has diverged, commands that are refused, and other nodes that publish /clock."""
        refusal, self._refusal = self._refusal, ""
        present = {"flight": self._diverged_words()} if self._diverged else {}
        clocks = self.count_publishers("/clock") if self._sim_time is not None else 1
        if clocks > 1:
            present["/clock"] = f"{clocks} nodes publish it; fly with speed 1, or give each its own ROS_DOMAIN_ID"
        return present | ({self.inputs[COMMAND].name: refusal} if refusal else {})

    def _diverged_words(self) -> str:
        return f"diverged ({self._diverged}): publishes nothing until {self.get_fully_qualified_name()}/reset is called"

    def _on_command(self, message: Any) -> None:
        found = self._actuation.of_message(self._actuation.places(message.name), message.position)
        if isinstance(found, str) or not all(map(math.isfinite, found)):
            self._refused += 1
            why = found if isinstance(found, str) else "not finite"
            expected = ", ".join(self._allocation.joints)
            self._refusal = (
                f"commands refused: {why}; expected joints {expected}, got {', '.join(message.name) or 'none'}"
            )
            return
        thrust, *controls = found
        self._command = [*controls, thrust]
        self._commands, self._commanded = self._commands + 1, time.monotonic()

    def _on_time(self) -> None:
        """Simulate and publish the samples that are due."""
        if self._diverged:
            return
        for _ in range(self._pace.due(time.monotonic(), self._flight.samples)):
            start = time.perf_counter()
            reached, self._reached = self._reached, self._command
            now = live.step(self._simulator, self._flight, self._command)
            self._diverged = live.divergence(now)
            if self._diverged:
                return
            self._publish(now, reached)
            self._steps.add(time.perf_counter() - start)

    def _publish(self, now: LiveReading, reached: list[float]) -> None:
        """A sample's messages, and the command (rad, thrust N) that was reached with it."""
        stamp = self._start_ns + round(NANOSECONDS * now.time)
        if self._sim_time is not None:
            self._sim_time.publish(ClockMessage(clock=stamp_message(stamp)))
        ax, ay, az, p, q, r, *euler, V, alpha, beta = now.outputs.tolist()
        x, y, z, w = quaternion_from_euler(np.array([euler]), "flu")[0].tolist()
        orientation = Quaternion(x=x, y=y, z=z, w=w)
        self._publish_actuators(now, stamp, reached)
        self._air_data.publish(
            AirData(
                header=header(stamp, "air_data"),
                true_airspeed=V,
                angle_of_attack=alpha,
                sideslip=beta,
                air_density=now.density,
            )
        )
        self._imu.publish(
            Imu(
                header=header(stamp, "imu"),
                orientation=orientation,
                linear_acceleration=Vector3(x=ax, y=-ay, z=-az),
                angular_velocity=Vector3(x=p, y=-q, z=-r),
            )
        )
        if self._flight.samples % POSE_EVERY == 0:
            x, y, z = (ENU_NED @ now.state[:3]).tolist()
            pose = Pose(position=Point(x=x, y=y, z=z), orientation=orientation)
            self._pose.publish(PoseStamped(header=header(stamp, "map"), pose=pose))

    def _publish_actuators(self, now: LiveReading, stamp: int, reached: list[float]) -> None:
        """Positions at the stamp (ns) of a sample, or the command that was reached with it.

        Commands are linear between samples here: one that is reached with a sample is given half a step before.
        """
        commanded = self.values["surfaces"] == "commanded"
        *surfaces, thrust = reached if commanded else now.surfaces.tolist()
        if commanded:
            stamp -= round(0.5 * NANOSECONDS * self._simulator.step)
        joints, positions = self._allocation.joints, self._allocation.positions(surfaces, thrust)
        self._actuators.publish(JointState(header=header(stamp, ""), name=joints, position=positions))
