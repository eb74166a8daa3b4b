"""Hansen's J test: whether a residual is correlated with instruments after all unknowns have been fitted to them.

The unknowns are fitted anew to the part of the residual that is coherent with the instruments. What stays coherent then
is a deficiency of the model, whatever its cause (the test of overidentifying restrictions: Hansen (1982),
Econometrica 50(4)). The rest of the residual is noise, which no model of the aircraft can reduce.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.nuisances import HeldOutFlight
from sysid_node.gap.estimation.predictive_density import fit_on_other_flight
from sysid_node.gap.estimation.spectral_weights import amplitudes, residual_power
from sysid_node.gap.instruments.gust_free_signals import Instruments, gust_free_instruments, resonator_instruments
from sysid_node.gap.instruments.moment_equations import limited_step, moment_equations, weights_without_mean
from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE
from sysid_node.gap.thresholds import THRESHOLDS


@dataclass(frozen=True)
class OveridentificationTest:
    """Powers of a residual by channel (12,), in multiples of the noise level that its weights assume."""

    beyond: Array  # coherent with the instruments, less its expectation for noise of that level
    total: Array  # all of the residual
    chance: Array  # standard deviation of ``beyond`` for noise of that level
    noise: Array  # level of what is not coherent with the instruments

    @property
    def coherent(self) -> Array:
        """Power (12,) that is coherent with the instruments beyond its expectation."""
        return np.maximum(self.beyond, 0.0)

    @property
    def deviations(self) -> Array:
        """How many standard deviations (12,) the coherent power lies above what noise gives.

        Least squares leaves less than the noise where it attributed gusts to derivatives; so the noise is that which
        the instruments' own estimate leaves where they do not see (Basmann (1960), J. Am. Stat. Assoc. 55).
        """
        expected = 0.5 * self.chance**2
        return (self.beyond - (self.noise - 1.0) * expected) / (self.noise * self.chance)

    @property
    def share(self) -> Array:
        """Share (12,) of the residual's power that is coherent with the instruments."""
        return np.asarray(self.coherent / np.maximum(self.total, 1e-300))


def pooled_overidentification(fit: CandidateFit, held_out: Sequence[HeldOutFlight] = ()) -> OveridentificationTest:
    """The test of a fit's residual and of that on flights held out.

    By channel with the gust-free instruments, or with resonators where these find more, and more than chance. A flight
    on which the fit has no finite linearisation is left out.
    """
    on_each = [fit, *(fit_on_other_flight(fit, flight) for flight in held_out)]
    fits = [f for f in on_each if f.information is not None and np.isfinite(f.information).all()]
    usual, resonant = (
        pooled([overidentification_of(f, reweighted_powers(f, by), by) for f in fits])
        for by in (gust_free_instruments, resonator_instruments)
    )
    more = resonant.deviations > np.maximum(usual.deviations, THRESHOLDS.instruments.chance)
    names = [f.name for f in fields(OveridentificationTest)]
    return OveridentificationTest(**{n: np.where(more, getattr(resonant, n), getattr(usual, n)) for n in names})


def pooled(parts: Sequence[OveridentificationTest]) -> OveridentificationTest:
    """The test of several flights together: what is in all of them adds up, chance does not."""
    columns = (np.array([getattr(part, f.name) for part in parts]) for f in fields(OveridentificationTest))
    beyond, total, chance, noise = columns
    weight = chance**2 / (chance**2).sum(axis=0)
    return OveridentificationTest(
        beyond.sum(axis=0), total.sum(axis=0), np.sqrt((chance**2).sum(axis=0)), (weight * noise).sum(axis=0)
    )


def overidentification_of(
    fit: CandidateFit, powers: Sequence[Array] | None = None, by: Instruments = gust_free_instruments
) -> OveridentificationTest:
    """The test of a fit's residual on the flights fitted.

    ``powers`` (L, 12) by flight are those of the noise: with the same ones, residuals of several fits compare. Without
    them they are the fit's own.
    """
    equations = moment_equations(fit, powers or fit.powers, by)
    step = limited_step(equations, fit)
    coherent, total, size, others = (np.zeros(len(CHANNELS)) for _ in range(4))
    for flight in equations.flights:
        remainder = flight.rows - flight.slopes @ step
        for axis, directions in flight.basis.items():
            series = remainder[:, :, axis].ravel()
            coherent[axis] += float(np.sum((directions.T @ series) ** 2))
            total[axis] += float(np.sum(series**2))
            size[axis] += directions.shape[1]
            others[axis] += INDEPENDENT_SHARE * np.count_nonzero(series) - directions.shape[1]
    noise = np.maximum((total - coherent) / np.maximum(others, 1.0), 1.0)
    return OveridentificationTest(coherent - size, total, np.sqrt(2.0 * np.maximum(size, 1.0)), noise)


def reweighted_powers(fit: CandidateFit, by: Instruments) -> tuple[Array, ...]:
    """Power (L, 12) by flight of the residual that the instruments' own estimate leaves: weights of a second step.

    Least squares leaves too little where it attributed gusts to derivatives. What a sharp step then leaves at other
    frequencies would stand out of a noise that is too low there (Hansen (1982): the covariance must be that at the true
    parameters).
    """
    equations, powers = moment_equations(fit, fit.powers, by), []
    step = limited_step(equations, fit)
    for flight, moments in zip(fit.flights, equations.flights, strict=True):
        remainder = (moments.rows - moments.slopes @ step).reshape(len(moments.rows), -1)
        left = amplitudes(remainder, weights_without_mean(flight.model, flight.power))
        power = residual_power(flight.model, left, flight.point)
        power[0] = flight.power[0]
        powers.append(power)
    return tuple(powers)
