"""The covariance of all derivatives: beside the published errors, and beside the scatter of many noisy flights."""

from dataclasses import replace

import numpy as np
import pytest
from plant import exact_flight, made_aircraft

from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator
from sysid_node.online.estimates.covariance import EstimateCovariance, estimate_covariance
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.types import SAMPLE_COLUMNS

TIME = np.arange(0.0, 8.0, 0.02)
SETTINGS = OnlineSettings(method="sls_rft", settle_time=0.0)


def flown(aircraft: Aircraft, samples: np.ndarray) -> EstimatorState:
    state = estimator.init(aircraft, SETTINGS)
    for time, sample in zip(TIME.tolist(), samples.tolist(), strict=True):
        estimator.update(state, time, sample)
    return state


def found(state: EstimatorState) -> EstimateCovariance:
    covariance = estimate_covariance(state)
    assert covariance is not None
    return covariance


@pytest.mark.parametrize("ideal", [True, False])
def test_its_diagonals_are_the_published_errors_and_it_is_positive(ideal: bool) -> None:
    aircraft = replace(made_aircraft(), ideal=ideal)
    rng = np.random.default_rng(3)
    samples = exact_flight(aircraft, TIME)
    samples[:, SAMPLE_COLUMNS.index("az")] += 0.2 * rng.normal(size=TIME.size)
    state = flown(aircraft, samples)
    covariance, published = found(state), estimate(state).derivatives
    rows = [published[name] for name in covariance.names]
    for part, error in (
        ("statistical", "statistical_error"),
        ("systematic", "systematic_error"),
        ("total", "standard_error"),
    ):
        matrix = getattr(covariance, part)
        np.testing.assert_allclose(
            np.sqrt(matrix.diagonal()), [getattr(row, error) for row in rows], rtol=1e-6, atol=1e-12
        )
        scale = np.sqrt(np.maximum(matrix.diagonal(), 1e-30))
        assert np.linalg.eigvalsh(matrix / scale[:, None] / scale).min() > -1e-6
    assert np.any(covariance.systematic) != ideal


def test_a_wrong_area_moves_all_derivatives_together() -> None:
    """A coefficient is a force over q S: where the area S alone is uncertain, by 10 %, all are off by it together."""
    made = made_aircraft()
    aircraft = replace(made, stated_tolerances={"geometry.S": 0.1 * made.geometry.S})
    covariance = found(flown(aircraft, exact_flight(aircraft, TIME)))
    i, j = (covariance.names.index(name) for name in ("CL_alpha", "Cm_alpha"))
    systematic = covariance.systematic
    assert np.sqrt(systematic[i, i]) == pytest.approx(0.1 * made.derivatives["CL_alpha"].value, rel=0.02)
    # a positive and a negative derivative move apart
    assert systematic[i, j] == pytest.approx(-np.sqrt(systematic[i, i] * systematic[j, j]), rel=1e-3)


@pytest.mark.slow
def test_correlations_are_those_of_many_flights() -> None:
    """Monte Carlo, 24 flights: of white noise on one force the estimates scatter together as stated."""
    aircraft, rng = made_aircraft(), np.random.default_rng(11)
    exact, column = exact_flight(aircraft, TIME), SAMPLE_COLUMNS.index("az")
    values, stated = [], []
    for _ in range(24):
        samples = exact.copy()
        samples[:, column] += 0.3 * rng.normal(size=TIME.size)
        state = flown(aircraft, samples)
        covariance, derivatives = found(state), estimate(state).derivatives
        places = [covariance.names.index(name) for name in ("CL_alpha", "CL_q", "CL_de")]
        values.append([derivatives[covariance.names[i]].value for i in places])
        stated.append(covariance.statistical[np.ix_(places, places)])
    scatter, mean = np.cov(np.array(values).T), np.mean(stated, axis=0)
    of_flights, of_covariance = (m / np.sqrt(np.outer(m.diagonal(), m.diagonal())) for m in (scatter, mean))
    # a correlation of 24 draws has a standard error of (1 - r^2) / sqrt(60)
    limit = 3.0 * (1.0 - of_covariance**2) / np.sqrt(24.0) + 1e-9
    assert np.all(np.abs(of_flights - of_covariance) < limit), (of_flights, of_covariance)
    assert np.abs(of_covariance - np.eye(3)).max() > 0.3  # there is something to compare


def test_its_correlation_is_numpys_of_draws_with_that_covariance() -> None:
    """Without the derivatives whose errors have no end."""
    rng = np.random.default_rng(5)
    root = rng.normal(size=(3, 3))
    total = np.full((4, 4), np.inf)
    total[np.ix_([0, 2, 3], [0, 2, 3])] = root @ root.T
    names, matrix = EstimateCovariance(("a", "endless", "b", "c"), total, np.zeros((4, 4))).correlation()
    assert names == ("a", "b", "c")
    drawn = np.corrcoef(root @ rng.normal(size=(3, 200_000)))
    np.testing.assert_allclose(matrix, drawn, atol=0.01)


def test_nothing_is_known_before_the_first_data() -> None:
    assert estimate_covariance(estimator.init(made_aircraft(), SETTINGS)) is None
