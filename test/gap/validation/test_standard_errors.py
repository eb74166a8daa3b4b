"""Errors that know of a model that is not right; truth: an aileron that loses half its effect in mid-flight."""

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.instruments.liml import liml_estimate
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.gap.validation.standard_errors import standard_errors, with_standard_error
from sysid_node.sim import Simulator


def ratio(model: ResidualModel, name: str) -> float:
    """Standard error of a nuisance over that of a remainder that is noise."""
    nuisances = nuisances_of(model.simulator.aircraft, model)
    fit = liml_estimate(CandidateFitter(nuisances, Checkpoint()).fit_set(unfitted([model], nuisances), []).fit)
    errors, plain = standard_errors(fit), np.sqrt(np.diag(fit.covariance))
    assert (errors >= plain).all()
    order = [i for i, s in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if s]
    place = order.index(model.simulator.names.index(name))
    return float(errors[place] / plain[place])


def test_of_the_right_model_they_are_those_of_noise(plain_model) -> None:
    assert ratio(plain_model, "derivative_error.Cl_da") < 1.6


@pytest.mark.slow
@pytest.mark.parametrize("turbulence", ["none", "light"])
def test_what_changes_in_flight_is_less_certain(aircraft, make_flight, turbulence) -> None:
    effects = {"control_effectiveness_loss": {"aileron": 0.5, "onset": 13.0}}
    model = residual_model_of(Simulator(aircraft, 50.0), make_flight(effects, seed=4, turbulence=turbulence))
    assert ratio(model, "derivative_error.Cl_da") > 2.0


def test_a_size_is_no_better_known_than_the_model_and_a_moment_is_no_size() -> None:
    assert with_standard_error("time_constant", 0.1, 0.0) == [
        0.1,
        pytest.approx(THRESHOLDS.validation.discrepancy * 0.1),
    ]
    assert with_standard_error("arm", -0.2, 0.01) == [
        -0.2,
        pytest.approx(np.hypot(0.01, THRESHOLDS.validation.discrepancy * 0.2)),
    ]
    assert with_standard_error("onset", 30.0, 0.02) == [30.0, 0.02]
