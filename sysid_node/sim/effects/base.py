"""The description of an effect: its name, station, equation, source and parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp

from sysid_node.sim.model.layout import ParameterLayout, Scalar, Values

#: The chain, in the order in which a command becomes a message.
STATIONS = (
    "command",
    "actuator",
    "airflow",
    "aerodynamics",
    "propulsion",
    "mass",
    "structure",
    "sensors",
    "clock",
)


@dataclass(frozen=True)
class SimulationParameter:
    """One number of an effect.

    An effect is neutral while all of its parameters with ``switch`` are neutral; the others only shape it.
    ``reciprocal`` names the usual quantity of which this is the reciprocal, where its neutral value is infinite.
    """

    name: str
    unit: str
    meaning: str
    scale: float  # a plausible size: 1 sigma of what real aircraft show
    neutral: float = 0.0
    lower: float = -math.inf
    upper: float = math.inf
    switch: bool = True
    reciprocal: str = ""


@dataclass(frozen=True)
class Effect:
    """One way in which an aircraft differs from its file. ``parameters`` may depend on the aircraft's layout."""

    name: str
    station: str
    summary: str
    equation: str
    source: str
    parameters: Callable[[ParameterLayout], tuple[SimulationParameter, ...]]
    shared: str = (
        ""  # the parameter that all controls share, to which each control's own is added: see ``each_control``
    )


#: Name of the throttle among the controls that have a parameter of their own.
THROTTLE = "throttle"


def fixed(*parameters: SimulationParameter) -> Callable[[ParameterLayout], tuple[SimulationParameter, ...]]:
    """The same parameters for every aircraft."""
    return lambda layout: parameters


def per_control(
    unit: str,
    meaning: str,
    scale: float,
    *others: SimulationParameter,
    lower: float = -math.inf,
    upper: float = math.inf,
) -> Callable[[ParameterLayout], tuple[SimulationParameter, ...]]:
    """One switch for each aerodynamic control, named after it; then the ``others``."""

    def parameters(layout: ParameterLayout) -> tuple[SimulationParameter, ...]:
        switches = (
            SimulationParameter(c, unit, f"{meaning}, {c}", scale, lower=lower, upper=upper) for c in layout.controls
        )
        return (*switches, *others)

    return parameters


def each_control(
    shared: SimulationParameter, *others: SimulationParameter, throttle: bool = False
) -> Callable[[ParameterLayout], tuple[SimulationParameter, ...]]:
    """What all controls share, what each has in addition, named after it, and the ``others``.

    A control's value is ``of_control``: the sum of both. One parameter then moves all controls, and another one alone,
    so that both can be fitted. Users state the sum for each control, see ``stated``.
    """
    size = shared.upper - shared.lower

    def parameters(layout: ParameterLayout) -> tuple[SimulationParameter, ...]:
        names = (*layout.controls, *((THROTTLE,) if throttle else ()))
        per_control = (
            SimulationParameter(c, shared.unit, f"{shared.meaning}, {c}: added", shared.scale, lower=-size, upper=size)
            for c in names
        )
        return (shared, *per_control, *others)

    return parameters


def of_control(values: Values, shared: str, control: str) -> Scalar:
    """The value of one control: what all share and its own, not negative."""
    total = values[shared] + values[control]
    return jnp.where(total >= 0.0, total, 0.0)  # its derivative at zero is one; that of a maximum would be a half


#: The parameter of effects that begin during a flight.
ONSET = SimulationParameter("onset", "s", "time at which it sets in", 10.0, neutral=-10.0, switch=False)
