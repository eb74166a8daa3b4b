"""First-order lag of the motor."""

from __future__ import annotations

from sysid_node.sim.effects.actuator_lag import first_order
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="motor_lag",
    station="propulsion",
    summary="Thrust follows its command with a first-order lag.",
    equation="time_constant dT/dt + T = command, solved exactly for commands linear between samples",
    source="Stevens, Lewis & Johnson (2016), Aircraft Control and Simulation (engine of the F-16 model)",
    parameters=fixed(SimulationParameter("time_constant", "s", "time constant", 0.2, lower=0.0, upper=10.0)),
)


def advance(values: Values, thrust: Scalar, command0: Scalar, command1: Scalar, step: Scalar) -> Scalar:
    """Thrust (N) one step (s) later, as the command goes from command0 to command1 (N)."""
    return first_order(values["time_constant"], thrust, command0, command1, step)
