"""Pneumatic and mechanical lag of the air data."""

from __future__ import annotations

from sysid_node.sim.effects.actuator_lag import first_order, first_order_series
from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed
from sysid_node.sim.model.layout import Scalar, Values

EFFECT = Effect(
    name="air_data_lag",
    station="sensors",
    summary="Airspeed and flow angles follow the truth with a first-order lag.",
    equation="time_constant dy/dt + y = truth, solved exactly for a truth linear between samples",
    source="Haering (1995), NASA TM-104316 (pneumatic lag)",
    parameters=fixed(SimulationParameter("time_constant", "s", "time constant", 0.05, lower=0.0, upper=2.0)),
)


def advance(values: Values, y: Scalar, truth0: Scalar, truth1: Scalar, step: Scalar) -> Scalar:
    """The lagged flow (3,) one step (s) later, as the truth goes from truth0 to truth1."""
    return first_order(values["time_constant"], y, truth0, truth1, step)


def behind(values: Values, rate: Scalar, step: Scalar) -> Scalar:
    """Truth minus lagged flow (N, 3), from the truth's rate (N, 3) in units per s; settled on the first sample."""
    time_constant = values["time_constant"]
    return time_constant * first_order_series(time_constant, rate, step, rate[0])


def undo(values: Values, y: Scalar, rate: Scalar) -> Scalar:
    """The truth (N, 3) before the lag, from the lagged flow and its rate."""
    return y + values["time_constant"] * rate
