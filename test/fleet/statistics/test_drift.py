"""Steps and trends are found with their dates and sizes, and chance is called drift as often as stated."""

import numpy as np
import pytest
from fleet_flights import START, flight
from scipy import stats

from sysid_node.fleet.statistics.contrasts import compare_contrasts
from sysid_node.fleet.statistics.drift import find_drift
from sysid_node.fleet.statistics.false_discovery import adjusted
from sysid_node.fleet.statistics.random_effects import flight_scatter_of_others
from sysid_node.fleet.statistics.series import DAY, series_by_type

FIRST_DAY = START.timestamp() / DAY


def tail_of(values, error=0.01):
    flights = [flight("t", 10 * i, [value], error) for i, value in enumerate(values)]
    return series_by_type(flights)["cdrw", "Cl_da"]


def test_a_step_has_its_date_and_size():
    noise = 0.01 * np.random.default_rng(0).standard_normal(12)
    drift = find_drift(tail_of(0.2 + noise - 0.04 * (np.arange(12) >= 7)), 0.0, 100)
    assert drift.course.kind == "step"
    assert drift.course.since - FIRST_DAY == pytest.approx(70)
    assert drift.course.first < drift.course.since <= drift.course.last
    assert drift.change == pytest.approx(-0.04, abs=3 * drift.error)
    assert drift.before == pytest.approx(0.2, abs=0.01)
    assert drift.p_value < 1e-4


def test_a_trend_is_told_from_a_step():
    noise = 0.01 * np.random.default_rng(1).standard_normal(14)
    drift = find_drift(tail_of(0.2 + noise - np.linspace(0, 0.1, 14)), 0.0, 100)
    assert drift.course.kind == "trend"
    assert drift.change == pytest.approx(-0.1, abs=3 * drift.error)


def test_p_values_are_uniform_where_nothing_drifts():
    """Kolmogorov and Smirnov's test of 300 p-values under the null, with the scale estimated (Student's t)."""
    generator, n, freedom = np.random.default_rng(3), 9, 12
    courses = np.array([*((np.arange(n) >= k).astype(float) for k in range(2, n - 1)), np.linspace(0, 1, n)])
    found = []
    for k in range(300):
        scale = np.sqrt(generator.chisquare(freedom) / freedom)
        value = generator.standard_normal(n) / scale
        tests = compare_contrasts(value, np.eye(n), courses, [*["step"] * (n - 3), "trend"], freedom, seed=k)
        found.append(tests.p_value)
    small = np.array([p for p in found if p < 0.04])  # those that count are simulated; larger ones may be bounds
    assert len(small) / 300 == pytest.approx(0.04, abs=0.03)
    assert stats.kstest(small / 0.04, "uniform").pvalue > 1e-3


def test_a_systematic_error_is_no_drift():
    """It is the same in all flights, however large."""
    flights = [flight("t", 10 * i, [0.2 + 0.001 * (-1) ** i], 0.01, systematic=1.0) for i in range(8)]
    assert find_drift(series_by_type(flights)["cdrw", "Cl_da"], 0.0, 50).p_value > 0.5


def test_a_step_at_a_maintenance_needs_less_evidence():
    """The same step is surer where its date was known beforehand."""
    noise = 0.01 * np.random.default_rng(5).standard_normal(12)
    series = tail_of(0.2 + noise - 0.02 * (np.arange(12) >= 7))
    searched, known = find_drift(series, 0.0, 100), find_drift(series, 0.0, 100, [FIRST_DAY + 65])
    assert known.course.since == searched.course.since == pytest.approx(FIRST_DAY + 70)
    assert known.p_value < 0.5 * searched.p_value


def test_a_tail_that_scatters_more_than_the_others_is_tested_by_its_own_scatter():
    """Errors four times as large as stated: by the stated ones, most tails would be called changed."""
    generator = np.random.default_rng(6)
    small = [
        find_drift(tail_of(0.2 + 0.04 * generator.standard_normal(10)), 0.0, 200).p_value < 0.01 for _ in range(60)
    ]
    assert sum(small) <= 4


def test_a_tail_that_drifts_does_not_widen_the_scatter_it_is_held_against():
    generator = np.random.default_rng(7)
    flights = [
        flight(f"t{j}", 10 * i, [0.2 + 0.02 * generator.standard_normal() - (j == 0) * 0.02 * i], 0.01)
        for j in range(5)
        for i in range(9)
    ]
    series = series_by_type(flights)["cdrw", "Cl_da"]
    scatter = flight_scatter_of_others(series.value, series.statistical, series.systematic, series.tail)
    assert scatter.value[0] == pytest.approx(np.sqrt(0.02**2 - 0.01**2), rel=0.35)
    assert (scatter.value[1:] > 1.4 * scatter.value[0]).all()
    assert scatter.freedom.tolist() == [32] * 5


def test_four_flights_are_too_few():
    assert find_drift(tail_of([0.1, 0.1, 0.2, 0.2]), 0.0, 50) is None


def test_adjusted_p_values_are_those_of_scipy():
    p = np.array([0.001, 0.2, 0.011, 0.04, 0.03, 0.9])
    assert adjusted(p) == pytest.approx(stats.false_discovery_control(p, method="bh"))
