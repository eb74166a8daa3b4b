"""Tolerances are limits: a nuisance never goes beyond three of them, whatever the data say."""

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import CandidateFit, unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def shifted(aircraft) -> CandidateFit:
    """A centre of gravity far off, which unlimited derivatives would pass off as a Cm_alpha."""
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"cg_shift": {"x": 0.06}}, seed=13))
    nuisances = nuisances_of(aircraft, model)
    return converged(with_candidates(unfitted([model], nuisances), [], nuisances, ()))


def test_none_is_beyond_its_limit_and_some_stand_at_it(shifted) -> None:
    now, sigma, limit = shifted.stacked
    assert (np.abs(now) <= limit * (1.0 + 1e-12)).all()
    assert (np.abs(now / sigma) > THRESHOLDS.priors.limit - 1e-6).any()


def test_what_stands_at_its_limit_is_not_uncertain(shifted) -> None:
    now, _, limit = shifted.stacked
    np.testing.assert_array_equal(shifted.uncertain, np.abs(now) < limit * (1.0 - 1e-9))


def test_priors_cost_what_they_say(shifted) -> None:
    now, sigma, _ = shifted.stacked
    assert shifted.prior_score == pytest.approx(-0.5 * np.sum((now / sigma) ** 2))
    assert shifted.prior_score < -9.0 / 2.0


def test_a_wider_prior_has_its_price(shifted) -> None:
    names = shifted.simulator.names
    own = tuple(i for i, name in enumerate(names) if name.startswith("derivative_error.Cm_"))
    wide = shifted.nuisances.without(frozenset({"derivative_error"}), names, own)
    moved = np.isin(wide.indices, own)
    assert 4 <= moved.sum() < len(wide.indices)
    np.testing.assert_allclose(wide.sigma / shifted.nuisances.sigma, np.where(moved, 5.0, 1.0))
    assert wide.widened == pytest.approx(moved.sum() * np.log(5.0))


def test_a_prior_is_widened_once(shifted) -> None:
    names = shifted.simulator.names
    own = tuple(i for i, name in enumerate(names) if name.startswith("derivative_error.Cm_"))
    once = shifted.nuisances.without(frozenset({"derivative_error"}), names, own)
    again = once.without(frozenset({"derivative_error", "actuator_lag"}), names, own)
    np.testing.assert_array_equal(again.sigma, once.sigma)
    assert again.widened == once.widened


def test_a_delay_that_is_blamed_is_no_nuisance(shifted) -> None:
    names = shifted.simulator.names
    kept = shifted.nuisances.without(frozenset({"command_delay"}), names)
    left = {names[i] for i in kept.indices}
    assert "actuator_stamp_delay.delay" not in left and "air_data_delay.delay" in left


def test_what_a_nuisance_at_its_limit_holds_is_given_back(aircraft) -> None:
    """Truth: the bias that was flown. Values that move alone, the nuisance at its limit, creep."""
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"actuator_bias": {"elevator": -0.06}}, seed=21))
    nuisances = nuisances_of(aircraft, model)
    (bias,) = (c for c in candidates_of(model.simulator, [model]) if c.effect == "actuator_bias")
    fit = with_candidates(converged(unfitted([model], nuisances)), [bias], nuisances, [0.0, 0.0, 0.0])
    cm, limit = (nuisances.indices.index(model.simulator.names.index("derivative_error.Cm_0")), nuisances.limit)
    stuck = [flight.point.copy() for flight in fit.flights]
    stuck[0][nuisances.indices[cm]] = limit[cm]
    assert converged(fit.at(stuck)).values[0] == pytest.approx(-0.06, rel=0.1)
