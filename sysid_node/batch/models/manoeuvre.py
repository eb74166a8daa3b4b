"""The data of a manoeuvre in the order of a model's inputs, outputs and states, and whether they fit it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.errors import InputError
from sysid_node.flight.record import Array


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
