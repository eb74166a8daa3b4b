"""Steps and trends are found with their dates and sizes, and chance is called drift as often as stated."""

import numpy as np
import pytest
from fleet_flights import START, flight
from scipy import stats

from sysid_node.fleet.statistics.contrasts import compare_contrasts
from sysid_node.fleet.statistics.drift import find_drift
from sysid_node.fleet.statistics.false_discovery import adjusted
from sysid_node.fleet.statistics.series import DAY, series_by_type

FIRST_DAY = START.timestamp() / DAY


def tail_of(values, error=0.01):
    flights = [flight("t", 10 * i, [value], error) for i, value in enumerate(values)]
    return series_by_type(flights)["cdrw", "Cl_da"]


def test_a_step_has_its_date_and_size():
    noise = 0.01 * np.random.default_rng(0).standard_normal(12)
    drift = find_drift(tail_of(0.2 + noise - 0.04 * (np.arange(12) >= 7)), 0.0, 100)
    assert drift.kind == "step"
    assert drift.since - FIRST_DAY == pytest.approx(70)
    assert drift.first < drift.since <= drift.last
    assert drift.change == pytest.approx(-0.04, abs=3 * drift.error)
    assert drift.before == pytest.approx(0.2, abs=0.01)
    assert drift.p_value < 1e-4


def test_a_trend_is_told_from_a_step():
    noise = 0.01 * np.random.default_rng(1).standard_normal(14)
    drift = find_drift(tail_of(0.2 + noise - np.linspace(0, 0.1, 14)), 0.0, 100)
    assert drift.kind == "trend"
    assert drift.change == pytest.approx(-0.1, abs=3 * drift.error)


def test_p_values_are_uniform_where_nothing_drifts():
    """Kolmogorov and Smirnov's test of 300 p-values under the null, with the scale estimated (Student's t)."""
    generator, n, freedom = np.random.default_rng(3), 9, 12
    courses = np.array([*((np.arange(n) >= k).astype(float) for k in range(2, n - 1)), np.linspace(0, 1, n)])
    found = []
    for k in range(300):
        scale = np.sqrt(generator.chisquare(freedom) / freedom)
        tests = compare_contrasts(generator.standard_normal(n) / scale, np.eye(n), courses, freedom, seed=k)
        found.append(tests.p_value)
    small = np.array([p for p in found if p < 0.04])  # those that count are simulated; larger ones may be bounds
    assert len(small) / 300 == pytest.approx(0.04, abs=0.03)
    assert stats.kstest(small / 0.04, "uniform").pvalue > 1e-3


def test_a_systematic_error_is_no_drift():
    """It is the same in all flights, however large."""
    flights = [flight("t", 10 * i, [0.2 + 0.001 * (-1) ** i], 0.01, systematic=1.0) for i in range(8)]
    assert find_drift(series_by_type(flights)["cdrw", "Cl_da"], 0.0, 50).p_value > 0.5


def test_four_flights_are_too_few():
    assert find_drift(tail_of([0.1, 0.1, 0.2, 0.2]), 0.0, 50) is None


def test_adjusted_p_values_are_those_of_scipy():
    p = np.array([0.001, 0.2, 0.011, 0.04, 0.03, 0.9])
    assert adjusted(p) == pytest.approx(stats.false_discovery_control(p, method="bh"))
