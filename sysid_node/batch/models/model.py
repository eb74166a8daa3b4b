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
class Parameter:
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
    parameters: tuple[Parameter, ...]
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

        def moved(parameter: Parameter) -> Parameter:
            if parameter.name not in values:
                return parameter
            return replace(parameter, start=float(np.clip(values[parameter.name], parameter.lower, parameter.upper)))

        return self.changed(parameters=tuple(moved(parameter) for parameter in self.parameters))


@dataclass(frozen=True)
class ManoeuvreData:
    """The data of one manoeuvre in the order of a model's inputs, outputs and states.

    ``time`` (N,) s, increasing; ``inputs`` (N, nu), complete; ``outputs`` (N // every, ny) as measured, each the mean
    over ``every`` samples, NaN = not measured; ``initial_state`` (nx,) at ``time[0]``. Raises InputError on too few
    samples and wrong shapes.
    """

    time: Array
    inputs: Array
    outputs: Array
    initial_state: Array
    name: str = "flight"
    every: int = 1

    def __post_init__(self) -> None:
        samples = self.time.size
        if samples < 5:
            raise InputError(f"{self.name}: {samples} samples; a manoeuvre needs at least 5")
        if not (np.isfinite(self.time).all() and (np.diff(self.time) > 0.0).all()):
            raise InputError(f"{self.name}: time must be finite and increase")
        for kind, wanted in (("inputs", samples), ("outputs", samples // self.every)):
            rows = getattr(self, kind).shape[0]
            if getattr(self, kind).ndim != 2 or rows != wanted:
                raise InputError(f"{self.name}: {kind} have {rows} rows for {samples} times; expected {wanted}")
        if not np.isfinite(self.initial_state).all():
            raise InputError(f"{self.name}: initial state {self.initial_state} is not finite")

    def __len__(self) -> int:
        return int(self.time.size)

    @property
    def output_time(self) -> Array:
        """The mean time (N // every,), s, of the samples of each output."""
        return block_means(self.time, self.every)

    @property
    def step(self) -> float:
        """Median sampling interval, s."""
        return float(np.median(np.diff(self.time)))


def block_means(values: Array, every: int) -> Array:
    """Means (N // every, ...) over ``every`` rows each; an incomplete block at the end is dropped."""
    rows = len(values) // every
    return np.asarray(values[: rows * every].reshape(rows, every, *values.shape[1:]).mean(axis=1))


def check_manoeuvres(model: StateSpaceModel, manoeuvres: Sequence[ManoeuvreData]) -> None:
    """Raises InputError where a manoeuvre does not fit the model, lacks inputs, or measures nothing."""
    if not manoeuvres:
        raise InputError(f"model {model.name}: no manoeuvre given; at least one is needed")
    for manoeuvre in manoeuvres:
        sizes = (manoeuvre.inputs.shape[1], manoeuvre.outputs.shape[1], manoeuvre.initial_state.size)
        wanted = (len(model.inputs), len(model.outputs), len(model.states))
        if sizes != wanted:
            raise InputError(
                f"{manoeuvre.name}: {sizes[0]} inputs, {sizes[1]} outputs, {sizes[2]} states; "
                f"model {model.name} has {wanted[0]}, {wanted[1]}, {wanted[2]}"
            )
        gaps = ~np.isfinite(manoeuvre.inputs)
        if gaps.any():
            row, column = np.argwhere(gaps)[0]
            raise InputError(
                f"{manoeuvre.name}: input {model.inputs[column]} is missing at {manoeuvre.time[row]:.3f} s "
                f"({int(gaps[:, column].sum())} samples in all); cut the flight there or leave it out of the model"
            )
    for column, name in enumerate(model.outputs):
        if not any(np.isfinite(manoeuvre.outputs[:, column]).any() for manoeuvre in manoeuvres):
            raise InputError(f"output {name} was never measured; leave it out of model {model.name}")


def check_every_output_measured(model: StateSpaceModel, manoeuvres: Sequence[ManoeuvreData], method: str) -> None:
    """Raises InputError where an output has gaps or is a mean over samples, which ``method`` (a noun) cannot use."""
    for manoeuvre in manoeuvres:
        if manoeuvre.every != 1:
            raise InputError(
                f"{manoeuvre.name}: {method} needs an output at every sample, not means over {manoeuvre.every}"
            )
        gaps = np.argwhere(~np.isfinite(manoeuvre.outputs))
        if gaps.size:
            raise InputError(
                f"{manoeuvre.name}: output {model.outputs[gaps[0][1]]} has gaps, the first at "
                f"{manoeuvre.time[gaps[0][0]]:.2f} s; {method} needs every sample of an output: cut the flight there, "
                "leave that output out, or use output_error"
            )
