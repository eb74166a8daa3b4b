"""The description of an effect: its name, station, equation, source and parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from sysid_node.sim.model.layout import Layout

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
class Parameter:
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
    parameters: Callable[[Layout], tuple[Parameter, ...]]


def fixed(*parameters: Parameter) -> Callable[[Layout], tuple[Parameter, ...]]:
    """The same parameters for every aircraft."""
    return lambda layout: parameters


def per_control(
    unit: str, meaning: str, scale: float, *others: Parameter, lower: float = -math.inf, upper: float = math.inf
) -> Callable[[Layout], tuple[Parameter, ...]]:
    """One switch for each aerodynamic control, named after it; then the ``others``."""

    def parameters(layout: Layout) -> tuple[Parameter, ...]:
        switches = (Parameter(c, unit, f"{meaning}, {c}", scale, lower=lower, upper=upper) for c in layout.controls)
        return (*switches, *others)

    return parameters


#: The parameter of effects that begin during a flight.
ONSET = Parameter("onset", "s", "time at which it sets in", 10.0, neutral=-10.0, switch=False)
