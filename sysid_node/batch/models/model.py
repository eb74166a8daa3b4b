"""State-space models with unknown parameters, x' = f(x, u, theta), y = g(x, u, theta), and a manoeuvre's data."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import jax
import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.record import Array

#: Numbers in the order of some names; each may be a JAX scalar or a time history of one.
Scalars = Sequence[jax.Array]

#: ``(states, inputs, parameters) -> values``, in JAX operations only, without side effects.
EquationFunction = Callable[[Scalars, Scalars, Scalars], Scalars]


class ModelEquations(NamedTuple):
    """A model's equations without its parameters' values and bounds; compiled programs depend on these alone."""

    derivative: EquationFunction
    output: EquationFunction


@dataclass(frozen=True)
class ModelParameter:
    """One parameter of a model: its start value, its bounds, and what is known of it beforehand.

    ``prior`` is a value known from elsewhere and its 1-sigma uncertainty (None: nothing is known); ``fixed`` keeps the
    parameter at ``start``. Raises InputError where ``start`` is not finite or outside the bounds.
    """

    name: str
    start: float
    unit: str = ""
    lower: float = -math.inf
    upper: float = math.inf
    prior: tuple[float, float] | None = None
    fixed: bool = False

    def __post_init__(self) -> None:
        if not math.isfinite(self.start):
            raise InputError(f"parameter {self.name}: start value {self.start} is not a number; give a finite one")
        if not self.lower <= self.start <= self.upper:
            raise InputError(
                f"parameter {self.name}: start value {self.start:g} is outside its bounds "
                f"{self.lower:g} to {self.upper:g}; move one or the other"
            )
        if not self.lower < self.upper:
            raise InputError(f"parameter {self.name}: bounds {self.lower:g} to {self.upper:g} hold no value")
        if self.prior is not None and not (math.isfinite(self.prior[0]) and self.prior[1] > 0.0):
            raise InputError(
                f"parameter {self.name}: prior {self.prior[0]:g} +- {self.prior[1]:g}; expected a number and a 1-sigma "
                "uncertainty above zero"
            )


@dataclass(frozen=True, eq=False)
class StateSpaceModel:
    """A dynamic system with unknown parameters.

    ``derivative`` returns the states' derivatives and ``output`` the outputs, from states, inputs and parameters, each
    a sequence of scalars in the order of the names given here (SI, radians, body axes FRD).
    """

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[ModelParameter, ...]
    derivative: EquationFunction
    output: EquationFunction
    units: dict[str, str] = field(default_factory=dict)  # of states and outputs, for tables
    driven: Mapping[str, float] | None = None  # states with process noise (None: all) and its approximate 1 sigma, in
    # the state's unit per root second; 0: not known

    def __post_init__(self) -> None:
        for kind in ("states", "inputs", "outputs", "names"):
            names = getattr(self, kind)
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise InputError(f"model {self.name}: {kind} named twice: {', '.join(twice)}")

    @property
    def dynamics(self) -> ModelEquations:
        """The equations without the parameters' values."""
        return ModelEquations(self.derivative, self.output)

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in the order of theta."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def driven_states(self) -> tuple[str, ...]:
        """The states with process noise."""
        return self.states if self.driven is None else tuple(self.driven)

    @property
    def start(self) -> Array:
        """Start values (P,)."""
        return np.array([parameter.start for parameter in self.parameters])

    def changed(self, **changes: object) -> StateSpaceModel:
        """The same model with some fields replaced."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def fixed(self) -> StateSpaceModel:
        """The same model with every parameter fixed at its start value."""
        return self.changed(parameters=tuple(replace(parameter, fixed=True) for parameter in self.parameters))

    def started_at(self, values: Mapping[str, float]) -> StateSpaceModel:
        """The same model with other start values (clipped into the bounds) for some parameters."""
        unknown = sorted(set(values) - set(self.names))
        if unknown:
            raise InputError(f"model {self.name} has no parameter {', '.join(unknown)}; it has {', '.join(self.names)}")

        def moved(parameter: ModelParameter) -> ModelParameter:
            if parameter.name not in values:
                return parameter
            return replace(parameter, start=float(np.clip(values[parameter.name], parameter.lower, parameter.upper)))

        return self.changed(parameters=tuple(moved(parameter) for parameter in self.parameters))
