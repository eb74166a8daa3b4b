"""Instruments: signals that gusts cannot have caused, by which a residual is tested and sizes are estimated.

Gusts are in every residual, and the aircraft answers them: therefore least squares attributes part of their effect to
the derivatives. No pilot's command anticipates a gust, however. The steps in the commands, delayed by lags, even
products of flow angles and airspeed, and what is weighted by the time since the flight's middle are uncorrelated with
gusts and serve as instruments. Each function gives those for forces and moments, then those for air data and attitude.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import bilinear, lfilter

from sysid_node.flight.record import Array
from sysid_node.gap.instruments.excitation import external_excitation
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS

#: Spread below which a signal counts as constant.
_CONSTANT = 1e-12

#: From a flight to signals (N, M) for forces and moments, and for air data and attitude, of zero mean and unit spread;
#: (0, 0) where there are none.
Instruments = Callable[[ResidualModel], tuple[Array, Array]]

_NONE = (np.empty((0, 0)), np.empty((0, 0)))


def gust_free_instruments(model: ResidualModel) -> tuple[Array, Array]:
    """Instruments that are uncorrelated with gusts: of commands, of even products of the motion, and of time.

    Those for air data and attitude are of the commands' steps alone, because gusts of all kinds are in air data.
    """
    excitation, time = external_excitation(model), _centred_time(model)
    if not excitation.all.size:
        return _NONE
    motion = {n: model.record[n] - model.record[n].mean() for n in ("alpha", "beta", "V", "p", "q", "r")}
    products = [motion["alpha"] ** 2, np.abs(motion["beta"]), motion["V"] * motion["alpha"]]
    drifting = [time * series for series in motion.values()]
    forces = [*_lagged_and_time_weighted(model, excitation.all), *products, *drifting]
    return _standardised(forces), _standardised(_lags_and_powers(model, excitation.steps))


def command_instruments(model: ResidualModel) -> tuple[Array, Array]:
    """Of ``gust_free_instruments`` those of commands alone.

    Products of the motion are uncorrelated with gusts on average, but not with the gusts of one flight.
    """
    excitation = external_excitation(model)
    if not excitation.all.size:
        return _NONE
    forces = _lagged_and_time_weighted(model, excitation.all)
    return _standardised(forces), _standardised(_lags_and_powers(model, excitation.steps))


def resonator_instruments(model: ResidualModel) -> tuple[Array, Array]:
    """Commands through resonators, for what oscillates on after a manoeuvre by itself, as fuel or a slung load does.

    Lags do not predict such a motion. The resonators are Kautz functions (Wahlberg (1994), IEEE Trans. Automatic
    Control 39(6)).
    """
    excitation = external_excitation(model)
    if not excitation.all.size:
        return _NONE
    both = [[*signals.T, *_through_resonators(model, signals)] for signals in (excitation.all, excitation.steps)]
    return _standardised(both[0]), _standardised(both[1])


def _centred_time(model: ResidualModel) -> Array:
    """Time about the flight's middle (N,), s: steady weather averages out of what is weighted by it."""
    return np.asarray(model.record.time - model.record.time.mean())


def _lagged_and_time_weighted(model: ResidualModel, signals: Array) -> list[Array]:
    """Signals (N, m) through lags, and weighted by time."""
    return [*_lags_and_powers(model, signals), *(_centred_time(model) * series for series in signals.T)]


def _through_resonators(model: ResidualModel, signals: Array) -> list[Array]:
    """Signals (N, m) through each resonator: its position and its velocity."""
    found = []
    damping = THRESHOLDS.instruments.damping
    for omega in 2.0 * np.pi * np.array(THRESHOLDS.instruments.resonances):
        for numerator in ([omega**2], [omega, 0.0]):
            b, a = bilinear(numerator, [1.0, 2.0 * damping * omega, omega**2], model.simulator.rate)
            found += [lfilter(b, a, series) for series in signals.T]
    return found


def _lags_and_powers(model: ResidualModel, signals: Array) -> list[Array]:
    """Signals (N, m) through lags, and their squares and cubes."""
    columns = [
        _lagged(series, lag, model.simulator.step) for series in signals.T for lag in THRESHOLDS.instruments.lags
    ]
    return [*columns, *(series**power for series in signals.T for power in (2, 3))]


def _standardised(columns: list[Array]) -> Array:
    """Columns (N, M) of zero mean and unit spread, without those that are constant."""
    if not columns:
        return np.empty((0, 0))
    table = np.column_stack(columns)
    table = table - table.mean(axis=0)
    spread = table.std(axis=0)
    return np.asarray(table[:, spread > _CONSTANT] / spread[spread > _CONSTANT])


def _lagged(series: Array, lag: float, step: float) -> Array:
    """A series (N,) through a first-order lag, s."""
    if lag == 0.0:
        return series
    decay = np.exp(-step / lag)
    lagged: Array = lfilter([1.0 - decay], [1.0, -decay], series)
    return lagged
