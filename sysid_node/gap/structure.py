"""What the remainder owes to the controls and the flow, whatever the cause: a test that knows no physics.

Rotating gusts, which no vane sees, are in every remainder, and the aircraft answers them: so least squares passes part
of them off as derivatives. But no pilot's command foretells a gust. The steps in the commands, through lags, even
products of flow angles and airspeed, and what is weighted by the time since the flight's middle therefore serve as
instruments: the unknowns are fitted anew to what of the remainder is coherent with these, and what then stays coherent
is structure (the test of over-identifying restrictions: Hansen (1982), Econometrica 50(4)). The rest is noise, which no
model of the aircraft beats.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from sysid_node.flight.record import Array
from sysid_node.gap.candidates import prior
from sysid_node.gap.fit import Fit, linearised, moved, real_rows, solve, weights
from sysid_node.gap.nuisance import gusty
from sysid_node.gap.view import CHANNELS, COEFFICIENTS, View

#: Time constants through which commands act, s; zero is directly.
_LAGS = (0.0, 0.06, 0.2, 0.6)

#: A command steps where it changes so many times faster than it usually does.
_STEP = 8.0

#: Time after which a step is forgotten, s.
_MEMORY = 3.0

#: Share of a command's movement that must be steps for its steps to stand for it.
_STEPPED = 0.3


@dataclass(frozen=True)
class Structure:
    """By coefficient (12,): power coherent with what was done, beyond chance, and all power, in noise levels."""

    coherent: Array
    total: Array
    deviations: Array  # how many standard deviations the coherent power lies above chance
    chance: Array  # such a standard deviation, in noise levels

    @property
    def share(self) -> Array:
        """Share (12,) of the remainder that is structure."""
        return np.asarray(self.coherent / np.maximum(self.total, 1e-300))


def structure_of(fit: Fit, like: Fit | None = None) -> Structure:
    """Of a fit's remainder; noise levels are those of ``like``, so that remainders of several fits compare."""
    basis, rows, slopes = _equations(fit, (like or fit).power)
    step, _ = _solution(fit, basis, rows, slopes)
    left = [r - J @ step for r, J in zip(rows, slopes, strict=True)]
    coherent, total, size = np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS))
    for U, r in zip(basis, left, strict=True):
        for axis, directions in U.items():
            series = r[:, :, axis].ravel()
            coherent[axis] += float(np.sum((directions.T @ series) ** 2))
            total[axis] += float(np.sum(series**2))
            size[axis] += directions.shape[1]
    beyond = coherent - size
    chance = np.sqrt(2.0 * np.maximum(size, 1.0))
    return Structure(np.maximum(beyond, 0.0), total, beyond / chance, chance)


def unbiased(fit: Fit) -> Fit:
    """The fit as the instruments have it where the air moves; in still air least squares has no bias, and errs less."""
    return instrumented(instrumented(fit)) if any(gusty(view) for view in fit.views) else fit


def instrumented(fit: Fit) -> Fit:
    """The fit with its unknowns as the instruments have them, which gusts do not bias; its errors are theirs too.

    One Gauss-Newton step from where the fit stands, and everything linearised there.
    """
    step, information = _solution(fit, *_equations(fit, fit.power))
    return replace(linearised(moved(fit, step)), information=information)


def _equations(fit: Fit, powers: tuple[Array, ...]) -> tuple[list[dict[int, Array]], list[Array], list[Array]]:
    """By flight: the instruments' directions, residuals (W, 2 L, 12), slopes (W, 2 L, 12, unknowns), without means."""
    basis, rows, slopes = [], [], []
    for view, power, own_power, r, J in zip(fit.views, powers, fit.power, fit.rows, fit.slopes, strict=True):
        weight = weights(view.windows, power)
        weight[[0, view.windows.frequencies.size]] = 0.0
        own = weights(view.windows, own_power)
        ratio = np.where(own > 0, weight / np.where(own > 0, own, 1.0), 0.0).ravel()
        rows.append((r * ratio).reshape(r.shape[0], -1, len(CHANNELS)))
        slopes.append((J * ratio[:, None]).reshape(r.shape[0], -1, len(CHANNELS), J.shape[2]))
        basis.append(_basis(view, weight))
    return basis, rows, slopes


def _solution(fit: Fit, basis: list[dict[int, Array]], rows: list[Array], slopes: list[Array]) -> tuple[Array, Array]:
    """The step of all unknowns that leaves least of what is coherent, their priors included; its information."""
    precision, pull = _priors(fit)
    information, right = np.diag(precision), -precision * pull
    for U, r, J in zip(basis, rows, slopes, strict=True):
        for axis, directions in U.items():
            seen = directions.T @ J[:, :, axis].reshape(-1, J.shape[3])
            information += seen.T @ seen
            right += seen.T @ (directions.T @ r[:, :, axis].ravel())
    for r, J in zip(fit.rows, fit.slopes, strict=True):  # means, from which gusts average out
        mean = J.reshape(J.shape[0], -1, len(CHANNELS), J.shape[2])[:, 0].reshape(-1, J.shape[2])
        information += mean.T @ mean
        right += mean.T @ r.reshape(r.shape[0], -1, len(CHANNELS))[:, 0].ravel()
    return solve(information, right), information


def _priors(fit: Fit) -> tuple[Array, Array]:
    """Precision of each unknown's prior, and how far the fit is from the prior's centre."""
    now, spread, _ = fit.stacked
    centre, sigma = prior(fit.views[0].simulator, fit.indices)
    return np.concatenate([sigma, spread]) ** -2.0, np.concatenate([fit.values - centre, now])


def _basis(view: View, weight: Array) -> dict[int, Array]:
    """Orthonormal directions (rows, m) that the instruments span, by coefficient that was measured."""
    of_forces, of_readings = instruments(view)
    found = {}
    for axis in np.flatnonzero(view.axes):
        table = of_forces if axis < len(COEFFICIENTS) else of_readings
        if not table.size:
            continue
        spectra = view.windows.transform(table)
        own = weight[:, axis : axis + 1]
        rows = real_rows(spectra, np.repeat(own, spectra.shape[2], axis=1))
        matrix = rows.reshape(rows.shape[0] * own.shape[0], -1)
        left, sizes, _ = np.linalg.svd(matrix, full_matrices=False)
        found[int(axis)] = np.asarray(left[:, sizes > 1e-3 * sizes[0]])
    return found


def instruments(view: View) -> tuple[Array, Array]:
    """Signals (N, M) that owe nothing to rotating gusts, each of zero mean and unit spread.

    And those that owe nothing to gusts of any kind, which are in every reading of the air data; there may be none.
    """
    (given, free), record = _deliberate(view), view.record
    columns = [_lagged(given[:, i], lag, view.simulator.step) for i in range(given.shape[1]) for lag in _LAGS]
    columns += [series for i in range(given.shape[1]) for series in (given[:, i] ** 2, given[:, i] ** 3)]
    moved = {n: record[n] - record[n].mean() for n in ("alpha", "beta", "V", "p", "q", "r")}
    even = [moved["alpha"] ** 2, np.abs(moved["beta"]), moved["V"] * moved["alpha"]]
    late = record.time - record.time.mean()  # weather that does not change averages out of what is weighted by time
    growing = [late * series for series in (*moved.values(), *given.T)]
    return _standard([*columns, *even, *growing]), _standard(columns if free else [])


def _standard(columns: list[Array]) -> Array:
    if not columns:
        return np.empty((0, 0))
    table = np.column_stack(columns)
    table = table - table.mean(axis=0)
    spread = table.std(axis=0)
    return np.asarray(table[:, spread > 1e-12] / spread[spread > 1e-12])


def _deliberate(view: View) -> tuple[Array, bool]:
    """What a pilot or a test program does with the commands (N, m), and whether it is free of gusts.

    Commands that step: their steps, forgotten after some seconds; between them they move with the autopilot, hence with
    the gusts. Where none steps (a multisine), the commands themselves.
    """
    commands = view.commands
    changes = np.diff(commands, axis=0, prepend=commands[:1])
    kept = np.where(np.abs(changes) > _STEP * np.median(np.abs(changes), axis=0), changes, 0.0)
    decay = np.exp(-view.simulator.step / _MEMORY)
    steps = lfilter([1.0], [1.0, -decay], kept, axis=0)
    usual = lfilter([1.0], [1.0, -decay], changes, axis=0)
    stepped = steps.std(axis=0) > _STEPPED * usual.std(axis=0)
    return (steps[:, stepped], True) if stepped.any() else (commands - commands.mean(axis=0), False)


def _lagged(series: Array, lag: float, step: float) -> Array:
    if lag == 0.0:
        return series
    decay = np.exp(-step / lag)
    lagged: Array = lfilter([1.0 - decay], [1.0, -decay], series)
    return lagged
