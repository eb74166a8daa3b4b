"""What tables add in compiled programs, against the same tables looked up one by one in NumPy."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import LookupTable
from sysid_node.dynamics.tables import array_tables
from sysid_node.sim import Simulator
from sysid_node.sim.stations.table_increments import table_increments

ALPHA = (-0.2, -0.05, 0.0, 0.1, 0.3)
TABLES = (
    LookupTable("CL", ("alpha",), (ALPHA,), (0.0, 0.01, 0.0, -0.02, -0.2)),
    LookupTable("CL", ("alpha", "V"), ((-0.2, 0.2), (10.0, 15.0, 20.0)), ((0.0, 0.0, 0.1), (0.0, 0.2, 0.1))),
    LookupTable("Cm", ("de",), ((-0.3, 0.0, 0.3),), (0.02, 0.0, 0.03)),
    LookupTable("Cn", ("beta", "dr"), ((-0.2, 0.0, 0.2), (-0.3, 0.3)), ((0.0, 0.01), (0.0, 0.0), (0.02, 0.0))),
)
RANDOM = np.random.default_rng(7)
N = 400


@pytest.fixture(scope="module")
def simulator():
    found = Simulator(replace(load_aircraft("cdrw"), tables=TABLES))
    assert found.model  # made here, and not while a function is traced
    return found


@pytest.fixture(scope="module")
def series():
    """The variables, some of them beyond the tables' ends."""
    found = {name: 0.15 * RANDOM.standard_normal(N) for name in ("alpha", "beta", "de", "dr")}
    return found | {"V": RANDOM.uniform(8.0, 22.0, N)}


def reduced(simulator, series):
    """As the simulator's regressors have it: V over the reference airspeed."""
    return series | {"V": series["V"] / simulator.aircraft.reference.airspeed}


def added(simulator, series):
    return table_increments(simulator.layout, simulator.model, reduced(simulator, series))


def test_the_tables_of_each_coefficient_are_summed(simulator, series):
    found, truth = added(simulator, series), array_tables(TABLES)(series)
    assert set(found) == set(truth)
    for name, values in truth.items():
        np.testing.assert_allclose(found[name], values, atol=1e-13)


def test_slopes_along_any_direction_are_the_differences(simulator, series):
    """Central differences, away from the tables' points, where the slope jumps."""
    directions = {name: jnp.asarray(RANDOM.standard_normal((3, N))) for name in series}
    expected, h = array_tables(TABLES), 1e-7

    def along(direction):
        return jax.jvp(lambda s: added(simulator, s), (dict(series),), (direction,))[1]

    found = jax.jit(jax.vmap(along))(directions)
    for k in range(3):
        ahead, behind = (
            expected({name: x + sign * h * np.asarray(directions[name][k]) for name, x in series.items()})
            for sign in (1.0, -1.0)
        )
        for name, values in ahead.items():
            np.testing.assert_allclose(found[name][k], (values - behind[name]) / (2.0 * h), atol=1e-6)


def test_single_numbers_and_an_aircraft_without_tables(simulator, series):
    one = {name: values[3] for name, values in series.items()}
    found = added(simulator, one)
    np.testing.assert_allclose(found["CL"], array_tables(TABLES)(series)["CL"][3], atol=1e-13)
    plain = Simulator(load_aircraft("cdrw"))
    assert added(plain, one) == {}
