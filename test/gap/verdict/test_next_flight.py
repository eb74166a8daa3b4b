"""The flight that tells effects apart; truth: a late command and an early stamp are the same thing in any flight."""

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised, unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.verdict.next_flight import Proposal, advice_in_words, propose
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def fits(aircraft) -> dict[str, CandidateFit]:
    """Explanations of a flight with late commands, each where it belongs."""
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"command_delay": {"delay": 0.08}}, seed=14))
    nuisances = nuisances_of(aircraft, model)
    base = unfitted([model], nuisances)
    table = {c.label: c for c in candidates_of(model.simulator, [model])}
    sizes = {"command_delay": 0.08, "actuator_stamp_delay": -0.08, "actuator_lag": 0.08}
    return {n: linearised(with_candidates(base, [table[n]], nuisances, [size])) for n, size in sizes.items()}


@pytest.mark.slow
def test_what_is_the_same_thing_is_not_parted(fits) -> None:
    chosen = fits["command_delay"]
    best = propose(chosen, [(chosen.candidates[0], fits["actuator_stamp_delay"])])
    assert best is not None and best.separation < 0.1


@pytest.mark.slow
def test_a_lag_and_a_delay_are_parted_by_some_flight(fits) -> None:
    chosen = fits["command_delay"]
    best = propose(chosen, [(chosen.candidates[0], fits["actuator_lag"])])
    assert best is not None and best.separation > 3.0
    assert np.isfinite(best.flown)


@pytest.mark.slow
def test_all_flights_that_were_flown_count(aircraft, fits) -> None:
    """Two flights that are alike tell the square root of two times as much as one."""
    chosen = fits["command_delay"]
    pairs = [(chosen.candidates[0], fits["actuator_lag"])]
    twice = replace(chosen, flights=chosen.flights * 2)
    one, two = propose(chosen, pairs), propose(twice, pairs)
    assert one is not None and two is not None
    assert two.flown == pytest.approx(np.sqrt(2.0) * one.flown)


def test_a_flight_in_which_an_alternative_diverges_tells_nothing_apart(fits) -> None:
    """SVD does not converge on what is not finite."""
    chosen, alternative = fits["command_delay"], fits["actuator_stamp_delay"]
    (flight,) = alternative.flights
    point = np.where(np.isin(np.arange(flight.point.size), alternative.indices), np.nan, flight.point)
    endless = replace(alternative, flights=(replace(flight, point=point),))
    best = propose(chosen, [(chosen.candidates[0], endless)])
    assert best is not None and best.separation == best.flown == 0.0


@pytest.mark.parametrize(
    ("verdict", "confused", "best", "words"),
    [
        ("no_gap", "", None, ""),
        ("no_gap", "a, b", Proposal("a sweep", 9.0, 1.0), ""),
        ("explained", "", None, ""),
        ("unknown_effect", "", None, "larger and at two airspeeds"),
        ("unsupported", "", None, "larger and at two airspeeds"),
        ("ambiguous", "a, b", None, "larger and at two airspeeds"),  # none can be flown
        ("ambiguous", "a, b", Proposal("a sweep", 2.9, 1.0), "measure on the ground"),
        ("ambiguous", "a, b", Proposal("a sweep", 3.0, 1.0), "a sweep, in still air: distinguishes a, b by 3 "),
        ("ambiguous", "a, b", Proposal("a sweep", 4.0, 4.0), "the same again"),
        ("explained", "a, b", Proposal("a sweep", 9.0, 4.0), "the manoeuvres flown by 4"),
    ],
)
def test_advice_by_what_is_confused(verdict: str, confused: str, best: Proposal | None, words: str) -> None:
    """By hand: at the threshold of separation, below it, and where the flight flown is as good."""
    found = advice_in_words(verdict, confused, best)
    assert words in found and bool(words) == bool(found)
