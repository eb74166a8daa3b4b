"""Sensor errors from the kinematics alone."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, clean, flight

from sysid_node.batch.data_compatibility import check_sensors, corrected
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord

#: What is wrong with the sensors of the flight below.
ERRORS = {"bias_q": 0.01, "bias_az": 0.3, "scale_alpha": 0.15, "bias_beta": 0.02, "bias_ax": -0.2}


@pytest.fixture(scope="module")
def spoilt():
    record = flight(1, seconds=12.0)
    columns = dict(record.columns)
    columns["q"] = columns["q"] + ERRORS["bias_q"]
    columns["az"] = columns["az"] + ERRORS["bias_az"]
    columns["ax"] = columns["ax"] + ERRORS["bias_ax"]
    columns["alpha"] = (1.0 + ERRORS["scale_alpha"]) * columns["alpha"]
    columns["beta"] = columns["beta"] + ERRORS["bias_beta"]
    return dataclasses.replace(record, columns=columns)


@pytest.fixture(scope="module")
def found(spoilt):
    return check_sensors(KESTREL, [spoilt])


@pytest.mark.slow
def test_errors_are_found_within_their_intervals(found):
    for name, estimate in found.fit.estimates.items():
        assert abs(estimate.value - ERRORS.get(name, 0.0)) < 4.0 * estimate.standard_error + 1e-4, name
    for name in ("bias_q", "bias_az", "scale_alpha", "bias_beta", "bias_ax"):
        assert abs(found.fit.values[name]) > 3.0 * found.fit.estimates[name].standard_error, name
        assert name in found.remarks[0]


@pytest.mark.slow
def test_corrected_flights_are_nearer_to_the_truth(found, spoilt):
    (better,), true = found.corrected, clean()
    for name in ("q", "az", "alpha", "beta", "ax"):
        before, after = (abs(np.mean(flown[name] - true[name])) for flown in (spoilt, better))
        assert after < 0.6 * before, name


@pytest.mark.slow
def test_good_sensors_are_left_alone():
    fit = check_sensors(KESTREL, [flight(2)]).fit
    scores = [e.value / e.standard_error for e in fit.estimates.values()]
    assert np.abs(scores).max() < 4.5
    assert np.mean(np.abs(scores) < 2.0) > 0.7


def test_correction_turns_a_reading_round():
    record = clean()
    spoilt = dataclasses.replace(record, columns={**record.columns, "alpha": 1.1 * record["alpha"] + 0.02})
    back = corrected(spoilt, {"bias_alpha": 0.02, "scale_alpha": 0.1})
    np.testing.assert_allclose(back["alpha"], record["alpha"], atol=1e-12)


def test_a_flight_without_airspeed_or_imu_is_refused():
    record = clean()
    for missing, said in (("V", "needs the airspeed"), ("q", "kinematic consistency needs q")):
        columns = {name: values for name, values in record.columns.items() if name != missing}
        with pytest.raises(InputError, match=said):
            check_sensors(KESTREL, [FlightRecord(record.time, columns, "blind")])
