"""Recursive least squares and its relatives: what they must equal, and what holds them."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, TRUTH, clean, flight

from sysid_node.batch.methods.constrained_least_squares import constrained_least_squares
from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.methods.error_filtering import error_filtering
from sysid_node.batch.methods.neural_gauss_newton import neural_gauss_newton
from sysid_node.batch.methods.recursive_least_squares import recursive_least_squares
from sysid_node.batch.regression.sequential import recursive_estimate
from sysid_node.errors import InputError

WATCHED = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "CY_beta", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr")

_KINKS = 0.08  # equation error, unfiltered, is off by as much


def off(fit):
    """The largest error of the watched derivatives, as a share of the truth."""
    return max(abs(fit.values[name] / TRUTH[name] - 1.0) for name in WATCHED)


@pytest.mark.parametrize("forgetting", [1.0, 0.98])
def test_one_pass_is_weighted_least_squares(forgetting):
    rng = np.random.default_rng(1)
    X = rng.normal(size=(300, 4))
    y = X @ [1.0, -2.0, 0.5, 3.0] + 0.1 * rng.normal(size=300)
    root = np.sqrt(forgetting ** np.arange(299, -1, -1.0))
    exact = np.linalg.lstsq(root[:, None] * X, root * y, rcond=None)[0]
    values, covariance = recursive_estimate(y, X, forgetting, lambda error: error)
    np.testing.assert_allclose(values, exact, rtol=1e-6)
    np.testing.assert_allclose(covariance, np.linalg.inv((X * root[:, None] ** 2).T @ X), rtol=1e-5, atol=1e-9)


def test_a_pass_along_the_flights_is_unfiltered_equation_error():
    records = [flight(1), flight(2, turn=-1)]
    passed, whole = recursive_least_squares(KESTREL, records), equation_error(KESTREL, records, low_pass=0.0)
    for name, estimate in passed.estimates.items():
        assert estimate.value == pytest.approx(whole.values[name], rel=1e-4, abs=1e-6), name
        assert estimate.standard_error == pytest.approx(whole.estimates[name].white_error, rel=0.02), name


@pytest.mark.parametrize("method", [recursive_least_squares, error_filtering, neural_gauss_newton])
def test_clean_flights_give_the_truth(method):
    """But for what differentiation makes of the kinks that steps of the surfaces leave in the rates."""
    assert off(method(KESTREL, [clean(), clean(turn=-1)])) < _KINKS


def test_a_filtered_error_keeps_the_noise_of_differentiation_out():
    """Accelerations of rates are the noisiest of all: the spread over flights tells."""
    spread = {}
    for method in (recursive_least_squares, error_filtering):
        values = [method(KESTREL, [flight(seed)]).values for seed in range(6)]
        spread[method] = np.std([[v[name] / TRUTH[name] for name in ("Cm_q", "Cm_de")] for v in values], axis=0)
    assert (spread[error_filtering] < 1.2 * spread[recursive_least_squares]).all()


def test_without_motion_the_constraints_hold_everything():
    record = clean()
    still = {name: np.full(len(record), float(values[0])) for name, values in record.columns.items()}
    fit = constrained_least_squares(KESTREL, [dataclasses.replace(record, columns=still)])
    for name in ("Cl_p", "Cl_da", "Cn_dr", "CY_r"):
        assert fit.values[name] == pytest.approx(TRUTH[name], rel=1e-6), name


def test_with_motion_the_data_win():
    wrong = {
        name: dataclasses.replace(d, value=1.3 * d.value, tolerance=abs(0.3 * d.value))
        for name, d in KESTREL.derivatives.items()
    }
    fit = constrained_least_squares(dataclasses.replace(KESTREL, derivatives=wrong), [clean(), clean(turn=-1)])
    assert off(fit) < _KINKS


def test_a_network_needs_the_attitude():
    record = clean()
    blind = {name: values for name, values in record.columns.items() if name != "theta"}
    with pytest.raises(InputError, match="neural_gauss_newton needs theta, not measured"):
        neural_gauss_newton(KESTREL, [dataclasses.replace(record, columns=blind)])
