"""The standard atmosphere. Truth: the tables of ICAO Doc 7488 (1993), by geopotential altitude."""

import numpy as np
import pytest

from sysid_node.dynamics.atmosphere import air_density, altitude_of, dynamic_pressure


@pytest.mark.parametrize(
    ("altitude", "density"), [(0.0, 1.2250), (1000.0, 1.11164), (5000.0, 0.736116), (11000.0, 0.363918)]
)
def test_density_is_that_of_the_table(altitude: float, density: float) -> None:
    assert air_density(altitude, np) == pytest.approx(density, rel=1e-5)


def test_altitude_is_the_inverse_of_density() -> None:
    assert altitude_of(float(air_density(1234.5, np))) == pytest.approx(1234.5, abs=1e-8)


def test_dynamic_pressure_at_sea_level() -> None:
    assert dynamic_pressure(1.225, 20.0) == pytest.approx(245.0)
