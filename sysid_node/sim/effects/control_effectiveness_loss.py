"""Loss of a part of a surface's effectiveness."""

from __future__ import annotations

from sysid_node.sim.effects.base import ONSET, Effect, per_control
from sysid_node.sim.model.layout import Scalar, Values
from sysid_node.sim.signals.smooth import soft_onset

EFFECT = Effect(
    name="control_effectiveness_loss",
    station="actuator",
    summary="From the onset on a surface does only part of what its deflection should do.",
    equation="x' = x (1 - fraction s(t)), s a logistic step of 0.05 s at the onset",
    source="Ducard (2009), Fault-tolerant Flight Control and Guidance Systems (actuator faults)",
    parameters=per_control("1", "fraction lost", 0.3, ONSET, lower=-1.0, upper=1.0),
)


def apply(values: Values, control: str, x: Scalar, time: Scalar) -> Scalar:
    """The deflection (rad) that would have the same effect without the loss, at a time (s)."""
    return x * (1.0 - values[control] * soft_onset(time, values["onset"]))
