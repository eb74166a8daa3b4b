"""The flight of ``sysid loop``: what is flown, what fails in it, and how its nodes are started."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError

#: Servos of an aircraft whose file states none.
ACTUATORS = "actuator_lag:time_constant=0.05"
ONSET, EXCITE_AT = 30.0, 3.0  # s: failure and first excitation
NODES: Mapping[str, tuple[str, ...]] = {
    "flight_simulator": (),
    "identifier": (),
    "exciter": ("watch:=true", "accuracy:=0.15"),
    "fault_monitor": (),
    "adaptive_controller": (),
}


@dataclass(frozen=True)
class LoopScenario:
    """The flight to simulate, and how it is controlled and identified."""

    aircraft: Aircraft
    name: str  # name or file of the aircraft, as the nodes receive it
    fail: str  # the effect that begins at ONSET; "" = none
    seconds: float
    adapt: bool
    turbulence: str
    method: str
    out: Path
    surfaces: str = "commanded"  # what the topic actuators carries: commands, or "measured" positions

    @property
    def effects(self) -> str:
        """The simulator's effects beside those of the aircraft file: servos, where the file states none."""
        return "" if "actuator_lag" in self.aircraft.effects else ACTUATORS

    @property
    def effects_after_failure(self) -> str:
        """The simulator's effects from ``ONSET`` on."""
        return " ".join(part for part in (self.effects, self.fail) if part)

    def check_simulation(self) -> None:
        """Raise InputError on turbulence that the simulator would refuse, and on effects, half a minute later."""
        from sysid_node.sim import Simulator  # noqa: PLC0415  # JAX takes its time
        from sysid_node.sim.flying import live  # noqa: PLC0415  # JAX takes its time
        from sysid_node.sim.signals.dryden import INTENSITIES  # noqa: PLC0415  # JAX takes its time

        if self.turbulence not in INTENSITIES:
            raise InputError(f"turbulence {self.turbulence!r}: expected one of {', '.join(INTENSITIES)}")
        live.vector(Simulator(self.aircraft), self.effects_after_failure.split())

    def arguments(self, node: str) -> list[str]:
        """The command-line arguments of a node."""
        parameters = [f"aircraft:={self.name}", *NODES[node]]
        if node == "flight_simulator":
            parameters += [f"effects:='{self.effects}'", f"turbulence:={self.turbulence}", f"surfaces:={self.surfaces}"]
        if node == "identifier":
            carried = "commands" if self.surfaces == "commanded" else "positions"
            parameters += [f"method:={self.method}", f"actuators:={carried}"]
        if node == "adaptive_controller":
            parameters.append(f"adapt:={str(self.adapt).lower()}")
        return ["--ros-args", *(word for parameter in parameters for word in ("-p", parameter))]


def set_points(time: float) -> dict[str, float]:
    """Commanded roll and pitch (rad) at a time of the flight (s): steps."""
    roll = (0.3, 0.0, -0.3, 0.0)[int(time / 4.0) % 4]
    pitch = (0.16, 0.08, 0.03, 0.08)[int((time + 1.0) / 3.0) % 4]
    return {"roll": roll, "pitch": pitch}
