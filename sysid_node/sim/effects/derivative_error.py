"""Errors of the aircraft file's derivatives."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter
from sysid_node.sim.model.layout import ParameterLayout


def _parameters(layout: ParameterLayout) -> tuple[SimulationParameter, ...]:
    return tuple(
        SimulationParameter(name, "1/rad" if not name.endswith("_0") else "1", f"added to the file's {name}", 0.1)
        for name in layout.derivatives
    )


EFFECT = Effect(
    name="derivative_error",
    station="aerodynamics",
    summary="The derivatives are not what the aircraft file says. Its scales are the file's tolerances.",
    equation="C' = C + sum error_i regressor_i",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 3 (aerodynamic model equations)",
    parameters=_parameters,
)
