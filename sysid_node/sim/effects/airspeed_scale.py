"""Scale error of the airspeed."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="airspeed_scale",
    station="sensors",
    summary="The airspeed reads too much or too little by a factor (position error, calibration).",
    equation="V' = V (1 + error)",
    source="Haering (1995), NASA TM-104316 (airdata measurement and calibration)",
    parameters=fixed(SimulationParameter("error", "1", "scale error", 0.04, lower=-0.9, upper=2.0)),
)


def apply(values: Values, airspeed: Scalar) -> Scalar:
    """The airspeed (m/s) that is read."""
    return airspeed * (1.0 + values["error"])


def undo(values: Values, airspeed: Scalar) -> Scalar:
    """The true airspeed (m/s) of a reading."""
    return airspeed / (1.0 + values["error"])
