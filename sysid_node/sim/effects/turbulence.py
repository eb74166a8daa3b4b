"""Continuous turbulence: an intensity on a given Dryden realisation."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="turbulence",
    station="airflow",
    summary="Continuous random gusts of the Dryden spectra.",
    equation="gust' = gust + intensity * (a realisation of intensity 1 m/s, sim.dryden)",
    source="MIL-F-8785C (1980), sec. 3.7.1.2 (Dryden form)",
    parameters=fixed(SimulationParameter("intensity", "m/s", "rms of the vertical gusts", 0.8, lower=0.0, upper=15.0)),
)


def apply(values: Values, gusts: Scalar, realisation: Scalar) -> Scalar:
    """Gusts (..., 6) plus turbulence: velocity of the air along body axes (m/s), its rotation (rad/s)."""
    return gusts + values["intensity"] * realisation
