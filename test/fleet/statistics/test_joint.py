"""The joint model is the single one for one derivative, and uses the correlation of errors for several."""

import numpy as np
import pytest
from fleet_flights import fleet, flight

from sysid_node.fleet.statistics.joint import fit_joint
from sysid_node.fleet.statistics.random_effects import fit_random_effects
from sysid_node.fleet.statistics.series import series_by_type


def test_of_one_derivative_is_the_single_model():
    flights = fleet()
    series = series_by_type(flights)["cdrw", "Cl_da"]
    single = fit_random_effects(series.value, series.statistical, series.systematic, series.tail)
    joint = fit_joint(flights, ["Cl_da"])
    assert joint.mean[0] == pytest.approx(single.mean, abs=2e-5)
    assert np.sqrt(joint.tail_scatter[0, 0]) == pytest.approx(single.tails.value, rel=0.02)
    assert np.sqrt(joint.flight_scatter[0, 0]) == pytest.approx(single.flights.value, rel=0.05)
    assert joint.level[:, 0] == pytest.approx(single.by_tail.level, abs=1e-4)


def test_finds_the_correlation_of_tails():
    generator, flights = np.random.default_rng(2), []
    for j in range(40):
        u = generator.standard_normal(2) @ np.linalg.cholesky([[1.0, 0.8], [0.8, 1.0]]).T
        flights += [flight(f"t{j:02d}", i, u + 0.2 * generator.standard_normal(2), 0.2) for i in range(4)]
    T = fit_joint(flights, ["Cl_da", "Cl_p"]).tail_scatter
    assert T[0, 1] / np.sqrt(T[0, 0] * T[1, 1]) == pytest.approx(0.8, abs=0.15)  # 40 tails: one sigma is 0.06


def test_needs_three_tails():
    assert fit_joint(fleet(tails=2), ["Cl_da", "Cl_p"]) is None
