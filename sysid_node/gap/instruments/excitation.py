"""External excitation: what a pilot or a test program commands, as against an autopilot's feedback to gusts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from sysid_node.flight.record import Array
from sysid_node.gap.flightdata.manoeuvre_window import step_changes
from sysid_node.gap.residuals.air_motion import is_gusty, with_longest_memory
from sysid_node.gap.residuals.residual_model import COEFFICIENTS, ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS

#: Longest delay with which an autopilot answers a gust, and the step between the delays that are modelled, s.
_LONGEST_DELAY, _DELAY_STEP = 2.0, 0.1

#: Penalty on the coefficients of the answer (ridge regression), as a share of the air's power.
_RIDGE = 1e-3


@dataclass(frozen=True)
class ExternalExcitation:
    """Signals (N, m) of the external inputs in the commands."""

    all: Array
    steps: Array  # those that are uncorrelated with gusts of any kind


def external_excitation(model: ResidualModel) -> ExternalExcitation:
    """The external excitation of a flight; none where gusts drive the commands.

    If surfaces step, it is their steps, which decay after some seconds, because between the steps an autopilot answers
    gusts. If none steps (a multisine), it is the commands themselves.
    """
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
    """Whether the aircraft's own dynamics can be identified: in still air, or with external excitation."""
    return not is_gusty(model) or bool(external_excitation(model).all.size)


def driven_by_gusts(model: ResidualModel) -> bool:
    """Whether the air's motion predicts most of the surfaces' motion: an autopilot that answers gusts.

    The motion of the air in the last seconds is that which the vanes show beyond the inertial instruments. Each half of
    the flight is predicted from a regression on the other. The median of the surfaces decides, because rolling gusts
    move no vane.
    """
    if not is_gusty(model):
        return False
    air, surfaces = _air(model), model.commands[:, :-1]
    surfaces = surfaces[:, surfaces.std(axis=0) > 0.0]
    if not air.shape[1] or not surfaces.shape[1]:
        return False
    rate = model.simulator.rate
    longest, grain = round(_LONGEST_DELAY * rate), max(round(_DELAY_STEP * rate), 1)
    lagged = np.column_stack([np.roll(air, lag, axis=0) for lag in range(0, longest, grain)])[longest:]
    return bool(
        np.median(_predicted_share(lagged - lagged.mean(axis=0), surfaces[longest:])) > THRESHOLDS.instruments.driven
    )


def _air(model: ResidualModel) -> Array:
    """Motion of the air (N, up to 3) in airspeed and flow angles, by an observer with the longest memory."""
    first = len(COEFFICIENTS)
    shown = first + np.flatnonzero(model.axes[first : first + 3])
    calm = with_longest_memory(model)
    return np.asarray((model.series - calm.predicted_series(model.simulator.neutral()))[:, shown])


def _predicted_share(causes: Array, series: Array) -> Array:
    """Share (S,) of each series' (N, S) variance that causes (N, K) predict in the half that was not fitted."""
    series, halves = series - series.mean(axis=0), np.array_split(np.arange(len(series)), 2)
    unexplained = np.zeros(series.shape[1])
    for fitted, unseen in (halves, halves[::-1]):
        X = causes[fitted]
        power = X.T @ X
        known = power + _RIDGE * np.trace(power) / len(power) * np.eye(len(power))
        weights = np.linalg.solve(known, X.T @ series[fitted])
        unexplained += ((series[unseen] - causes[unseen] @ weights) ** 2).sum(axis=0)
    return np.asarray(1.0 - unexplained / (series**2).sum(axis=0))
