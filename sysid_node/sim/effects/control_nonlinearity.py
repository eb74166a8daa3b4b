"""Controls whose effect grows less than their deflection."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, per_control
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="control_nonlinearity",
    station="aerodynamics",
    summary="Large deflections do less, per radian, than small ones.",
    equation="delta' = delta (1 - cubic delta^2)",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 3 (polynomial terms)",
    parameters=per_control("1/rad^2", "cubic term", 3.0, lower=-100.0, upper=100.0),
)


def apply(values: Values, control: str, deflection: Scalar) -> Scalar:
    """The deflection (rad) by which the linear derivatives are multiplied."""
    return deflection * (1.0 - values[control] * deflection * deflection)
