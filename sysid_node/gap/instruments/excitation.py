"""What a pilot or a test program does with the commands, as against what an autopilot does against the weather."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from sysid_node.flight.record import Array
from sysid_node.gap.flightdata.manoeuvre_window import step_changes
from sysid_node.gap.residuals.air_motion import is_gusty, with_longest_memory
from sysid_node.gap.residuals.residual_model import COEFFICIENTS, ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS

#: How long an autopilot answers to a gust, and how finely that is looked at, s.
_ANSWER, _GRAIN = 2.0, 0.1

#: Penalty on the answer's coefficients, as a share of the air's power: so many are no better than few.
_RIDGE = 1e-3


@dataclass(frozen=True)
class ExternalExcitation:
    """Signals (N, m) of what was done to the commands deliberately; ``steps`` are those that owe nothing to gusts."""

    all: Array
    steps: Array


def external_excitation(model: ResidualModel) -> ExternalExcitation:
    """Where surfaces step: their steps, forgotten after some seconds; between them an autopilot moves them with the
    gusts. Where none steps (a multisine), the commands themselves, unless the weather moves them."""
    commands = model.commands
    changes = np.diff(commands, axis=0, prepend=commands[:1])
    decay = np.exp(-model.simulator.step / THRESHOLDS.instruments.memory)
    steps = lfilter([1.0], [1.0, -decay], step_changes(commands), axis=0)
    usual = lfilter([1.0], [1.0, -decay], changes, axis=0)
    stepped = steps.std(axis=0) > THRESHOLDS.instruments.stepped * usual.std(axis=0)
    if stepped[:-1].any():
        return ExternalExcitation(steps[:, stepped], steps[:, stepped])
    if driven_by_gusts(model):
        return ExternalExcitation(commands[:, :0], commands[:, :0])
    surfaces = commands[:, :-1] - commands[:, :-1].mean(axis=0)
    return ExternalExcitation(np.concatenate([surfaces, steps[:, stepped]], axis=1), steps[:, stepped])


def externally_excited(model: ResidualModel) -> bool:
    """Whether the flight shows what the aircraft does of itself: still air, or commands that are not the weather's."""
    return not is_gusty(model) or bool(external_excitation(model).all.size)


def driven_by_gusts(model: ResidualModel) -> bool:
    """Whether the air's motion foretells most of what the surfaces do: an autopilot that answers to gusts.

    From the motion of the last seconds, as the vanes show it beyond the inertial instruments, half of the flight
    foretold by the other; the median of the surfaces, for rolling gusts move no vane.
    """
    if not is_gusty(model):
        return False
    air, surfaces = _air(model), model.commands[:, :-1]
    surfaces = surfaces[:, surfaces.std(axis=0) > 0.0]
    if not air.shape[1] or not surfaces.shape[1]:
        return False
    rate = model.simulator.rate
    longest, grain = round(_ANSWER * rate), max(round(_GRAIN * rate), 1)
    lagged = np.column_stack([np.roll(air, lag, axis=0) for lag in range(0, longest, grain)])[longest:]
    return bool(np.median(_foretold(lagged - lagged.mean(axis=0), surfaces[longest:])) > THRESHOLDS.instruments.driven)


def _air(model: ResidualModel) -> Array:
    """Motion of the air (N, up to 3), of airspeed and flow angles, as a long memory shows it."""
    first = len(COEFFICIENTS)
    shown = first + np.flatnonzero(model.axes[first : first + 3])
    calm = with_longest_memory(model)
    return np.asarray((model.series - calm.predicted_series(model.simulator.neutral()))[:, shown])


def _foretold(causes: Array, series: Array) -> Array:
    """Share (S,) of each of some series (N, S) that causes (N, K) foretell in the half not fitted."""
    series, halves = series - series.mean(axis=0), np.array_split(np.arange(len(series)), 2)
    left = np.zeros(series.shape[1])
    for fitted, unseen in (halves, halves[::-1]):
        X = causes[fitted]
        power = X.T @ X
        known = power + _RIDGE * np.trace(power) / len(power) * np.eye(len(power))
        weights = np.linalg.solve(known, X.T @ series[fitted])
        left += ((series[unseen] - causes[unseen] @ weights) ** 2).sum(axis=0)
    return np.asarray(1.0 - left / (series**2).sum(axis=0))
