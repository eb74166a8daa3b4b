"""A flight's record against a corrected model: its parameters as the believed aircraft's simulator holds them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.gap.estimation.predictive_density import Evidence, FlightEvidence
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.sim import Simulator

Array = NDArray[np.float64]


def everywhere(models: tuple[ResidualModel, ...], point: Array) -> Evidence:
    """Flights that are predicted with the same parameters throughout."""
    return Evidence(np.empty(0), tuple(FlightEvidence.throughout(model, point) for model in models))


def vector(simulator: Simulator, aircraft: Aircraft, effects: Mapping[str, Mapping[str, float]]) -> Array:
    """The parameters by which the believed aircraft becomes another, with these effects."""
    theta = simulator.vector({n: v for n, v in effects.items() if n != "derivative_error"})
    known = simulator.aircraft.derivatives
    for name, derivative in aircraft.derivatives.items():
        off = effects.get("derivative_error", {}).get(name, 0.0)
        theta[simulator.names.index(f"derivative_error.{name}")] = derivative.value + off - known[name].value
    return np.asarray(theta)
