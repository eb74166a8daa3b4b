"""The first-order response of each kind of method against the method itself on changed flights."""

import numpy as np
import pytest
from made_flight import KESTREL, flight

from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.methods.maximum_likelihood_estimation import MaximumLikelihoodEstimation
from sysid_node.batch.methods.recursive_least_squares import recursive_least_squares
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.batch.regression.regressors import regressor_matrix
from sysid_node.batch.settings import BatchSettings
from sysid_node.batch.systematic.clocks import corrected
from sysid_node.batch.systematic.flight_posterior import Imperfection
from sysid_node.batch.systematic.sensitivities import LikelihoodResponse, RegressionResponse

LATE = {Imperfection("delays.actuators"): 0.004}
RECORD = flight(1)
MOVED = corrected(KESTREL, RECORD, LATE)
SETTINGS = BatchSettings(rate=50.0, segment=0.0, states=("alpha", "q"))


def compared(change, expected, errors, share):
    """Whether a change is the expected one within a share of the largest, where it is more than chance."""
    scaled = (np.asarray(change) - expected) / errors
    assert np.abs(np.asarray(expected) / errors).max() > 1.0
    assert np.abs(scaled).max() < share * np.abs(np.asarray(expected) / errors).max()


def test_a_regression():
    fit, other = equation_error(KESTREL, [RECORD]), equation_error(KESTREL, [MOVED])
    change = RegressionResponse(KESTREL, [RECORD], fit.values, 3.0)([MOVED])
    expected = [other.values[name] - fit.values[name] for name in fit.values]
    compared(change, expected, np.sqrt(np.diag(fit.covariance)), 0.15)


@pytest.mark.parametrize("forgetting", [1.0, 0.8])
def test_a_regression_of_unfiltered_signals(forgetting):
    """Against weighted least squares of one coefficient, changed by the derivative of what is minimised."""
    fit = recursive_least_squares(KESTREL, [RECORD])
    change = RegressionResponse(KESTREL, [RECORD], fit.values, 0.0, forgetting)([MOVED])
    base, moved = (measured_coefficients(KESTREL, record) for record in (RECORD, MOVED))
    regressors = KESTREL.model_structure["Cm"]
    X, other = (regressor_matrix(flight, regressors) for flight in (base, moved))
    theta = np.array([fit.values[f"Cm_{name}"] for name in regressors])
    z = moved.coefficients["Cm"] - base.coefficients["Cm"] - (other - X) @ theta
    root = forgetting ** (0.5 * (base.time[-1] - base.time))
    exact = np.linalg.lstsq(root[:, None] * X, root * z, rcond=None)[0]
    names = list(fit.values)
    assert change[[names.index(f"Cm_{name}") for name in regressors]] == pytest.approx(exact, rel=1e-6)


def test_a_search_for_the_maximum_likelihood():
    search = MaximumLikelihoodEstimation.of("output_error", KESTREL, [RECORD], SETTINGS)
    fit, other = search.fit(), search.on([MOVED]).fit()
    residuals, jacobian = search.linearised(fit)
    change = LikelihoodResponse(residuals, [RECORD], jacobian, len(fit.estimates))([MOVED])
    expected = [other.values[name] - fit.values[name] for name in fit.values]
    compared(change, expected, np.sqrt(np.diag(fit.covariance)), 0.15)
