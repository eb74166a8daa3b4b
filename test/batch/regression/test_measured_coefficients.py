"""Coefficients and regressors from measured signals."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, clean, flight

from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord


def test_forces_and_air_data_are_moved_to_the_cg():
    moved = measured_coefficients(KESTREL, clean()).coefficients["CL"]
    ignored = dataclasses.replace(KESTREL, sensors=type(KESTREL.sensors)())
    assert np.abs(measured_coefficients(ignored, clean()).coefficients["CL"] - moved).max() > 0.02


def test_the_ground_is_left_out_and_a_record_of_nothing_else_refused():
    record = flight(5)
    parked = {**record.columns, "V": np.where(record.time < 2.0, 0.1, record["V"])}
    found = measured_coefficients(KESTREL, FlightRecord(record.time, parked, "taxi"))
    assert found.left_out == np.count_nonzero(record.time < 2.0)
    assert any("slower than" in remark for remark in found.remarks)
    with pytest.raises(InputError, match=r"only 0 of \d+ samples .* in which the aircraft flies"):
        measured_coefficients(KESTREL, FlightRecord(record.time, {**record.columns, "V": 0.0 * record["V"]}, "parked"))
