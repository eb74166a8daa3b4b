"""When coherence is structure; truth: Monte Carlo of noise that is stronger than the level it is counted in."""

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.aircraft.load import load_aircraft
from sysid_node.gap.estimation.candidate_fit import linearised, unfitted
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import HeldOutFlight, nuisances_of
from sysid_node.gap.instruments.gust_free_signals import (
    gust_free_instruments,
)
from sysid_node.gap.instruments.overidentification import (
    OveridentificationTest,
    overidentification_of,
    pooled,
    pooled_overidentification,
)
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import COEFFICIENTS, ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import Simulator

DIRECTIONS, ROWS = 37, 400


def measured(random: np.random.Generator, strength: float, structure: float = 0.0) -> OveridentificationTest:
    """One channel of noise of so many levels, and structure of so many along the instruments' directions."""
    series = np.sqrt(strength) * random.standard_normal(ROWS)
    series[:DIRECTIONS] += np.sqrt(structure) * random.choice([-1.0, 1.0], DIRECTIONS)
    inside, outside = float(np.sum(series[:DIRECTIONS] ** 2)), float(np.sum(series[DIRECTIONS:] ** 2))
    noise = max(outside / (ROWS - DIRECTIONS), 1.0)
    found = (inside - DIRECTIONS, inside + outside, np.sqrt(2.0 * DIRECTIONS), noise)
    return OveridentificationTest(*(np.array([value]) for value in found))


@pytest.mark.parametrize("strength", [1.0, 1.8])
def test_noise_is_chance_however_strong(strength: float) -> None:
    """Basmann's statistic: zero on average, of unit spread, whatever level least squares took for the noise."""
    random = np.random.default_rng(4)
    found = np.array([measured(random, strength).deviations[0] for _ in range(2000)])
    assert abs(found.mean()) < 0.2
    assert found.std() == pytest.approx(1.0, abs=0.15)


def test_structure_in_strong_noise_is_still_seen() -> None:
    random = np.random.default_rng(5)
    found = np.array([measured(random, 1.8, structure=4.0).deviations[0] for _ in range(200)])
    assert np.median(found) > 4.5


def test_flights_pooled_leave_chance_as_it_is_and_add_up_what_is_in_both() -> None:
    random = np.random.default_rng(6)
    chance = np.array([pooled([measured(random, 1.8), measured(random, 1.0)]).deviations[0] for _ in range(2000)])
    assert abs(chance.mean()) < 0.2
    assert chance.std() == pytest.approx(1.0, abs=0.15)
    alone, both = [], []
    for _ in range(200):
        flights = [measured(random, 1.2, structure=1.0) for _ in range(2)]
        alone.append(flights[0].deviations[0])
        both.append(pooled(flights).deviations[0])
    assert np.mean(both) == pytest.approx(np.sqrt(2.0) * np.mean(alone), rel=0.1)


def test_a_flight_on_which_no_numbers_come_of_the_fit_is_left_out(plain_model: ResidualModel) -> None:
    """On a flight held out, that is; of the one that was fitted they do."""
    nuisances = nuisances_of(plain_model.simulator.aircraft, plain_model)
    fit = linearised(unfitted([plain_model], nuisances))
    alone = pooled_overidentification(fit)
    nowhere = np.full_like(plain_model.measured, np.nan)
    unreadable = replace(plain_model, measurement=replace(plain_model.measurement, spectra=nowhere))
    left_out = pooled_overidentification(fit, [HeldOutFlight(unreadable, nuisances)])
    np.testing.assert_array_equal(left_out.deviations, alone.deviations)
    again = pooled_overidentification(fit, [HeldOutFlight(plain_model, nuisances)])  # the same flight twice
    np.testing.assert_allclose(again.beyond, 2.0 * alone.beyond)
    np.testing.assert_allclose(again.share, alone.share)


@pytest.mark.slow
def test_gusts_that_pass_for_derivatives_make_no_structure_of_sharp_steps() -> None:
    """Rolling gusts and short doublets, nothing else: least squares takes half of the roll's derivatives away, and what
    it then leaves of the doublets stands out of a noise that it has made too low."""
    aircraft, steps = load_aircraft("kestrel"), (("elevator", 0.05, 1.0), ("aileron", 0.06, 3.8), ("rudder", 0.11, 6.0))
    doublets = [f"doublet:{name}:amplitude={size}:width=0.4:start={at}:every=8:repeat=5" for name, size, at in steps]
    flight = fly(aircraft, {}, seed=4, turbulence="light", manoeuvre=doublets, duration=44.0)
    model = residual_model_of(Simulator(aircraft, 25.0), flight)
    fit = converged(unfitted([model], nuisances_of(aircraft, model)))
    roll = COEFFICIENTS.index("Cl")
    assert overidentification_of(fit, by=gust_free_instruments).deviations[roll] > THRESHOLDS.instruments.chance
    assert pooled_overidentification(fit).deviations[roll] < 0.6 * THRESHOLDS.instruments.chance
