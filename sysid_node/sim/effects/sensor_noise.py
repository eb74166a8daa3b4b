"""White noise of every sensor."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="sensor_noise",
    station="sensors",
    summary="Every reading carries white noise, in multiples of the aircraft file's.",
    equation="y' = y + scale sigma n, n a given realisation of unit variance",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 10 (instrument errors)",
    parameters=fixed(SimulationParameter("scale", "1", "of the file's sigmas", 1.0, lower=0.0, upper=100.0)),
)


def apply(values: Values, reading: Scalar, sigma: Scalar, realisation: Scalar) -> Scalar:
    """Readings (12,) with noise."""
    return reading + values["scale"] * sigma * realisation
