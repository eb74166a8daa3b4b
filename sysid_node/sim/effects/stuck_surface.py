"""A surface that jams at a fixed position."""

from __future__ import annotations

from sysid_node.sim.effects.base import ONSET, Effect, SimulationParameter
from sysid_node.sim.model.layout import ParameterLayout, Scalar, Values
from sysid_node.sim.signals.smooth import soft_onset

_SUFFIX = "_position"


def _parameters(layout: ParameterLayout) -> tuple[SimulationParameter, ...]:
    amounts = (
        SimulationParameter(c, "1", f"how much of {c} is stuck: 0 moves freely, 1 is jammed", 1.0, lower=0.0, upper=1.0)
        for c in layout.controls
    )
    positions = (
        SimulationParameter(c + _SUFFIX, "rad", f"where {c} is jammed", 0.05, lower=-1.5, upper=1.5, switch=False)
        for c in layout.controls
    )
    return (*amounts, *positions, ONSET)


EFFECT = Effect(
    name="stuck_surface",
    station="actuator",
    summary="From the onset on a surface stands at a fixed position, whatever is commanded.",
    equation="x' = x + amount s(t) (position - x), s a logistic step of 0.05 s at the onset",
    source="Ducard (2009), Fault-tolerant Flight Control and Guidance Systems (actuator faults)",
    parameters=_parameters,
)


def apply(values: Values, control: str, x: Scalar, time: Scalar) -> Scalar:
    """The surface's position (rad) at a time (s)."""
    share = values[control] * soft_onset(time, values["onset"])
    return x + share * (values[control + _SUFFIX] - x)
