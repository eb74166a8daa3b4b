"""The regressors of each coefficient, as far as the flights allow."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, clean, flight

from sysid_node.batch.regression.measured_coefficients import measured_coefficients, sensitivity_to_readings
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient, sensor_noises
from sysid_node.errors import InputError


def test_a_coefficient_that_one_flight_lacks_is_left_out():
    record = clean()
    gliding = dataclasses.replace(record, columns={n: v for n, v in record.columns.items() if n != "thrust"})
    flights = [measured_coefficients(KESTREL, r) for r in (record, gliding)]
    assert "CD" in regressors_by_coefficient(KESTREL, flights[:1])
    assert "CD" not in regressors_by_coefficient(KESTREL, flights)


def test_no_coefficient_at_all_is_refused():
    drag = {name: d for name, d in KESTREL.derivatives.items() if name.startswith("CD")}
    aircraft = dataclasses.replace(KESTREL, derivatives=drag)
    record = clean()
    gliding = dataclasses.replace(record, columns={n: v for n, v in record.columns.items() if n != "thrust"})
    with pytest.raises(InputError, match="no coefficient can be formed from these flights: thrust was not measured"):
        regressors_by_coefficient(aircraft, [measured_coefficients(aircraft, gliding)])


def test_columns_stand_in_the_order_asked_for():
    found = measured_coefficients(KESTREL, clean())
    np.testing.assert_array_equal(regressor_matrix(found, ("q", "0"))[:, 1], 1.0)


def test_the_vanes_noise_enters_by_its_variance():
    record = flight(3)
    sensors = sensitivity_to_readings(KESTREL, record)
    noises = sensor_noises(record.time, sensors, "Cm", ("alpha", "q"), 3.0)
    by_sensor = dict(zip(sensors, noises, strict=True))
    assert by_sensor["alpha"].variance == pytest.approx(KESTREL.noise["alpha"] ** 2, rel=0.3)
    np.testing.assert_allclose(by_sensor["alpha"].of_regressors[:, 0], 1.0, atol=0.1)  # the vane sits near the CG
