"""What the remainder owes to the controls and the flow, whatever the cause: a test that knows no physics.

Rotating gusts, which no vane sees, are in every remainder, and the aircraft answers them: so least squares passes part
of them off as derivatives. But no pilot's command foretells a gust. The steps in the commands, through lags, even
products of flow angles and airspeed, and what is weighted by the time since the flight's middle therefore serve as
instruments: the unknowns are fitted anew to what of the remainder is coherent with these, and what then stays coherent
is structure (the test of over-identifying restrictions: Hansen (1982), Econometrica 50(4)). The rest is noise, which no
model of the aircraft beats.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np
from scipy.signal import bilinear, lfilter

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidates import prior
from sysid_node.gap.estimation.fit import (
    CandidateFit,
    amplitudes,
    bounded_least_squares,
    real_rows,
    residual_power,
    step_limits,
    weights,
)
from sysid_node.gap.estimation.nuisances import Nuisances
from sysid_node.gap.estimation.predictive_density import fit_on_other_flight
from sysid_node.gap.instruments.excitation import external_excitation
from sysid_node.gap.residuals.residual_model import CHANNELS, COEFFICIENTS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE, Complex
from sysid_node.gap.thresholds import THRESHOLDS

#: Signals (N, M) for forces and moments, and for air data and attitude, of zero mean and unit spread; or none.
Instruments = Callable[[ResidualModel], tuple[Array, Array]]


@dataclass(frozen=True)
class OveridentificationTest:
    """By coefficient (12,): power coherent with what was done, less chance's, and all power, in noise levels."""

    beyond: Array
    total: Array
    chance: Array  # its standard deviation in noise of that level
    noise: Array  # level of what no instrument foretells

    @property
    def coherent(self) -> Array:
        """Power that is structure."""
        return np.maximum(self.beyond, 0.0)

    @property
    def deviations(self) -> Array:
        """How many standard deviations the coherent power lies above chance.

        Least squares leaves less than the noise where it passed gusts off as derivatives; chance is that of what the
        instruments' estimate leaves where they do not see (Basmann (1960), J. Am. Stat. Assoc. 55).
        """
        expected = 0.5 * self.chance**2
        return (self.beyond - (self.noise - 1.0) * expected) / (self.noise * self.chance)

    @property
    def share(self) -> Array:
        """Share (12,) of the remainder that is structure."""
        return np.asarray(self.coherent / np.maximum(self.total, 1e-300))


def pooled_overidentification(
    fit: CandidateFit, unseen: Sequence[ResidualModel] = (), own: Sequence[Nuisances] = ()
) -> OveridentificationTest:
    """Of a fit's remainder, and of that on flights held out, with what is allowed for in each.

    By channel as ``instruments`` see it, or ``ringing`` where that sees more and beyond chance. A flight on which no
    numbers come of the fit is left out.
    """
    there = [fit, *(fit_on_other_flight(fit, model, theirs) for model, theirs in zip(unseen, own, strict=True))]
    fits = [f for f in there if f.information is not None and np.isfinite(f.information).all()]
    usual, rings = (
        pooled([overidentification_of(f, reweighted(f, by), by) for f in fits])
        for by in (gust_free_instruments, resonator_instruments)
    )
    more = rings.deviations > np.maximum(usual.deviations, THRESHOLDS.instruments.chance)
    found = {
        f.name: np.where(more, getattr(rings, f.name), getattr(usual, f.name)) for f in fields(OveridentificationTest)
    }
    return OveridentificationTest(**found)


def pooled(parts: Sequence[OveridentificationTest]) -> OveridentificationTest:
    """Structure of several flights: what is in all of them adds up, chance does not."""
    beyond, total, chance, noise = (
        np.array([getattr(part, f.name) for part in parts]) for f in fields(OveridentificationTest)
    )
    weight = chance**2 / (chance**2).sum(axis=0)
    return OveridentificationTest(beyond.sum(axis=0), total.sum(axis=0), np.sqrt((chance**2).sum(axis=0)),
                     (weight * noise).sum(axis=0))  # fmt: skip


def overidentification_of(
    fit: CandidateFit, like: CandidateFit | None = None, by: Instruments | None = None
) -> OveridentificationTest:
    """Of a fit's remainder; noise levels are those of ``like``, so that remainders of several fits compare."""
    seen = moment_equations(fit, (like or fit).power, by or gust_free_instruments)
    step = limited_step(seen, fit)
    coherent, total, size, others = (np.zeros(len(CHANNELS)) for _ in range(4))
    for U, r, J in zip(seen.basis, seen.rows, seen.slopes, strict=True):
        left = r - J @ step
        for axis, directions in U.items():
            series = left[:, :, axis].ravel()
            coherent[axis] += float(np.sum((directions.T @ series) ** 2))
            total[axis] += float(np.sum(series**2))
            size[axis] += directions.shape[1]
            others[axis] += INDEPENDENT_SHARE * np.count_nonzero(series) - directions.shape[1]
    noise = np.maximum((total - coherent) / np.maximum(others, 1.0), 1.0)
    return OveridentificationTest(coherent - size, total, np.sqrt(2.0 * np.maximum(size, 1.0)), noise)


def reweighted(fit: CandidateFit, by: Instruments) -> CandidateFit:
    """The fit with the power of what the instruments' own estimate leaves, for the weights of a second step.

    Least squares leaves too little where it passed gusts off as derivatives: what a sharp step then leaves at other
    frequencies would stand out of noise that is too low there (Hansen (1982): the covariance must be that at the true
    parameters).
    """
    seen, powers = moment_equations(fit, fit.power, by), []
    step = limited_step(seen, fit)
    for model, power, r, J in zip(fit.models, fit.power, seen.rows, seen.slopes, strict=True):
        anew = residual_power(model, amplitudes((r - J @ step).reshape(len(r), -1), _weights(model, power)))
        anew[0] = power[0]
        powers.append(anew)
    return replace(fit, power=tuple(powers))


@dataclass(frozen=True)
class MomentEquations:
    """What the instruments see of a fit: a sum of squares, quadratic in the step of all unknowns, priors included.

    ``constant - 2 right . step + step . information step``; without means in ``rows`` (W, 2 L, 12) and ``slopes``
    (W, 2 L, 12, unknowns) by flight, of which ``basis`` holds the instruments' directions.
    """

    basis: list[dict[int, Array]]
    rows: list[Array]
    slopes: list[Array]
    information: Array
    right: Array
    constant: float


def moment_equations(
    fit: CandidateFit, powers: tuple[Array, ...], by: Instruments | None = None, *, whole: bool = False
) -> MomentEquations:
    """Those of a fit about where it stands, in noise of these powers (L, 12) by flight.

    ``whole``: with all of air data and attitude, whatever the instruments see of them.
    """
    basis, rows, slopes = _seen(fit, powers, by or gust_free_instruments)
    precision, pull = prior_terms(fit)
    information, right, constant = np.diag(precision), -precision * pull, float(precision @ pull**2)
    parts = [
        (directions.T @ r[:, :, axis].ravel(), directions.T @ J[:, :, axis].reshape(-1, J.shape[3]))
        for U, r, J in zip(basis, rows, slopes, strict=True)
        for axis, directions in U.items()
        if axis < len(COEFFICIENTS) or not whole
    ]
    if whole:
        kept = [(r[:, :, len(COEFFICIENTS) :], J[:, :, len(COEFFICIENTS) :]) for r, J in zip(rows, slopes, strict=True)]
        parts += [(r.ravel(), J.reshape(-1, J.shape[3])) for r, J in kept]
    for series, seen in [*parts, *_means(fit, powers)]:
        information += seen.T @ seen
        right += seen.T @ series
        constant += float(series @ series)
    return MomentEquations(basis, rows, slopes, information, right, constant)


def limited_step(seen: MomentEquations, fit: CandidateFit) -> Array:
    """The step (unknowns,) of least squares that leaves every unknown within its limits."""
    return bounded_least_squares(seen.information, seen.right, *step_limits(fit))


def _means(fit: CandidateFit, powers: tuple[Array, ...]) -> Iterator[tuple[Array, Array]]:
    """Means by flight, from which gusts average out: residuals (W 12,) and slopes (W 12, unknowns)."""
    for power, own_power, r, J in zip(powers, fit.power, fit.rows, fit.slopes, strict=True):
        ratio = np.sqrt(own_power[0] / power[0])
        mean = r.reshape(r.shape[0], -1, len(CHANNELS))[:, 0] * ratio
        slope = J.reshape(J.shape[0], -1, len(CHANNELS), J.shape[2])[:, 0] * ratio[:, None]
        yield mean.ravel(), slope.reshape(-1, J.shape[2])


def _seen(
    fit: CandidateFit, powers: tuple[Array, ...], by: Instruments
) -> tuple[list[dict[int, Array]], list[Array], list[Array]]:
    """By flight: the instruments' directions, residuals (W, 2 L, 12), slopes (W, 2 L, 12, unknowns), without means."""
    basis, rows, slopes = [], [], []
    for model, power, own_power, r, J in zip(fit.models, powers, fit.power, fit.rows, fit.slopes, strict=True):
        weight = _weights(model, power)
        own = weights(model.windows, own_power)
        ratio = np.where(own > 0, weight / np.where(own > 0, own, 1.0), 0.0).ravel()
        rows.append((r * ratio).reshape(r.shape[0], -1, len(CHANNELS)))
        slopes.append((J * ratio[:, None]).reshape(r.shape[0], -1, len(CHANNELS), J.shape[2]))
        key = by.__name__.encode() + weight.tobytes()
        basis.append(model.lately(key, partial(_basis, model, weight, by)))
    return basis, rows, slopes


def _weights(model: ResidualModel, power: Array) -> Array:
    """``weights`` (2 L, 12) without those of means."""
    weight = weights(model.windows, power)
    weight[[0, model.windows.frequencies.size]] = 0.0
    return weight


def prior_terms(fit: CandidateFit) -> tuple[Array, Array]:
    """Precision of each unknown's prior, and how far the fit is from the prior's centre."""
    now, spread, _ = fit.stacked
    centre, sigma = prior(fit.models[0].simulator, fit.indices)
    return np.concatenate([sigma, spread]) ** -2.0, np.concatenate([fit.values - centre, now])


def _basis(model: ResidualModel, weight: Array, by: Instruments) -> dict[int, Array]:
    """Orthonormal directions (rows, m) that the instruments span, by coefficient that was measured."""
    tables = model.once(f"spectra by {by.__name__}", lambda: _spectra(model, by))
    found = {}
    for axis in np.flatnonzero(model.axes):
        spectra = tables[0 if axis < len(COEFFICIENTS) else 1]
        if not spectra.size:
            continue
        own = weight[:, axis : axis + 1]
        rows = real_rows(spectra, np.repeat(own, spectra.shape[2], axis=1))
        matrix = rows.reshape(rows.shape[0] * own.shape[0], -1)
        left, sizes, _ = np.linalg.svd(matrix, full_matrices=False)
        found[int(axis)] = np.asarray(left[:, sizes > 1e-3 * sizes[0]])
    return found


def _spectra(model: ResidualModel, by: Instruments) -> list[Complex]:
    """Instruments by window and line, each (W, L, M); empty where there are none."""
    return [model.windows.transform(t) if t.size else np.empty((0, 0, 0), complex) for t in by(model)]


def gust_free_instruments(model: ResidualModel) -> tuple[Array, Array]:
    """What owes nothing to rotating gusts; and what owes nothing to gusts of any kind, which are in all air data."""
    given, late = external_excitation(model), _late(model)
    if not given.all.size:
        return _NONE
    moved = {n: model.record[n] - model.record[n].mean() for n in ("alpha", "beta", "V", "p", "q", "r")}
    flow = [moved["alpha"] ** 2, np.abs(moved["beta"]), moved["V"] * moved["alpha"]]
    aging = [late * series for series in moved.values()]
    return _standard([*_foretelling(model, given.all), *flow, *aging]), _standard(_shaped(model, given.steps))


def command_instruments(model: ResidualModel) -> tuple[Array, Array]:
    """Of ``instruments`` those of commands alone.

    What holds the motion owes nothing to gusts on average, but what the air does in one flight is coherent with it.
    """
    given = external_excitation(model)
    if not given.all.size:
        return _NONE
    return _standard(_foretelling(model, given.all)), _standard(_shaped(model, given.steps))


def resonator_instruments(model: ResidualModel) -> tuple[Array, Array]:
    """Commands through resonators: what swings on after a manoeuvre by a motion of its own, as fuel or a load does.

    Lags do not foretell it. Kautz functions (Wahlberg (1994), IEEE Trans. Automatic Control 39(6)).
    """
    given = external_excitation(model)
    if not given.all.size:
        return _NONE
    both = [[*signals.T, *_rung(model, signals)] for signals in (given.all, given.steps)]
    return _standard(both[0]), _standard(both[1])


_NONE = (np.empty((0, 0)), np.empty((0, 0)))


def _late(model: ResidualModel) -> Array:
    """Time about the flight's middle, s: weather that does not change averages out of what is weighted by it."""
    return np.asarray(model.record.time - model.record.time.mean())


def _foretelling(model: ResidualModel, given: Array) -> list[Array]:
    """Signals (N, m) shaped, and weighted by time."""
    return [*_shaped(model, given), *(_late(model) * series for series in given.T)]


def _rung(model: ResidualModel, given: Array) -> list[Array]:
    """Signals (N, m) through each resonator, where it is and how fast it moves."""
    found = []
    for omega in 2.0 * np.pi * np.array(THRESHOLDS.instruments.resonances):
        for top in ([omega**2], [omega, 0.0]):
            b, a = bilinear(top, [1.0, 2.0 * THRESHOLDS.instruments.damping * omega, omega**2], model.simulator.rate)
            found += [lfilter(b, a, series) for series in given.T]
    return found


def _shaped(model: ResidualModel, given: Array) -> list[Array]:
    """Signals (N, m) through lags, and their squares and cubes."""
    columns = [_lagged(series, lag, model.simulator.step) for series in given.T for lag in THRESHOLDS.instruments.lags]
    return [*columns, *(series**power for series in given.T for power in (2, 3))]


def _standard(columns: list[Array]) -> Array:
    if not columns:
        return np.empty((0, 0))
    table = np.column_stack(columns)
    table = table - table.mean(axis=0)
    spread = table.std(axis=0)
    return np.asarray(table[:, spread > 1e-12] / spread[spread > 1e-12])


def _lagged(series: Array, lag: float, step: float) -> Array:
    if lag == 0.0:
        return series
    decay = np.exp(-step / lag)
    lagged: Array = lfilter([1.0 - decay], [1.0, -decay], series)
    return lagged
