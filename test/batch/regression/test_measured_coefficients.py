"""Coefficients and regressors from measured signals."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, clean, flight

from sysid_node.aircraft.model import LookupTable, UncertainValue
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord


def test_forces_and_air_data_are_moved_to_the_cg():
    moved = measured_coefficients(KESTREL, clean()).coefficients["CL"]
    ignored = dataclasses.replace(KESTREL, sensors=type(KESTREL.sensors)())
    assert np.abs(measured_coefficients(ignored, clean()).coefficients["CL"] - moved).max() > 0.02


def test_moments_are_about_the_files_point_where_the_cg_is_elsewhere():
    """By hand: a force through the CG, which lies (x, y, z) from that point, adds (x, y, z) x force to the moments."""
    x, y, z = shift = (0.03, -0.01, 0.02)
    effects = {"cg_shift": {axis: UncertainValue(by) for axis, by in zip("xyz", shift, strict=True)}}
    at_cg = dataclasses.replace(KESTREL, sensors=type(KESTREL.sensors)())
    plain = measured_coefficients(at_cg, clean()).coefficients
    found = measured_coefficients(dataclasses.replace(at_cg, effects=effects), clean()).coefficients
    record, g, m = clean(), KESTREL.geometry, KESTREL.mass
    ax, ay, az = (m * record[name] for name in ("ax", "ay", "az"))
    area = 0.5 * record["rho"] * record["V"] ** 2 * g.S
    added = {"Cl": (y * az - z * ay) / g.b, "Cm": (z * ax - x * az) / g.cbar, "Cn": (x * ay - y * ax) / g.b}
    for name, values in plain.items():
        np.testing.assert_allclose(found[name] - values, added.get(name, 0.0) / area, atol=1e-12)


def test_the_ground_is_left_out_and_a_record_of_nothing_else_refused():
    record = flight(5)
    parked = {**record.columns, "V": np.where(record.time < 2.0, 0.1, record["V"])}
    found = measured_coefficients(KESTREL, FlightRecord(record.time, parked, "taxi"))
    assert found.left_out == np.count_nonzero(record.time < 2.0)
    assert any("slower than" in remark for remark in found.remarks)
    with pytest.raises(InputError, match=r"only 0 of \d+ samples .* in which the aircraft flies"):
        measured_coefficients(KESTREL, FlightRecord(record.time, {**record.columns, "V": 0.0 * record["V"]}, "parked"))


def test_a_sample_alone_in_a_gap_is_left_out():
    """It has no angular acceleration; truth for the others: the flight without it."""
    record = clean()
    lone = (record.time < 3.0) | (record.time > 5.0)
    there = lone | (np.arange(len(record)) == np.searchsorted(record.time, 4.0))

    def kept(samples: np.ndarray) -> FlightRecord:
        columns = {name: np.where(samples, values, np.nan) for name, values in record.columns.items()}
        return FlightRecord(record.time, columns, "gap")

    found, truth = measured_coefficients(KESTREL, kept(there)), measured_coefficients(KESTREL, kept(lone))
    assert found.left_out == truth.left_out > 150
    np.testing.assert_array_equal(found.coefficients["Cm"], truth.coefficients["Cm"])


def test_what_tables_add_is_subtracted_and_the_polar_has_the_whole_lift():
    """By NumPy's interpolation; a table of a coefficient that has no derivatives is not needed."""
    tables = (
        LookupTable("CL", ("alpha",), ((0.0, 0.05, 0.2),), (0.0, 0.02, -0.2)),
        LookupTable("Cm", ("V",), ((15.0, 25.0),), (0.0, 0.3)),
        LookupTable("Cl", ("p",), ((-0.1, 0.0, 0.1),), (0.01, 0.0, 0.01)),
        LookupTable("Cn", ("throttle",), ((0.0, 1.0),), (0.0, 0.02)),
    )
    plain = measured_coefficients(KESTREL, clean())
    found = measured_coefficients(dataclasses.replace(KESTREL, tables=tables), clean())
    x = {**plain.regressors, "V": plain.regressors["V"] * KESTREL.reference.airspeed}
    x["throttle"] = clean()["thrust"] / KESTREL.throttle.max_thrust
    added = {t.coefficient: np.interp(x[t.over[0]], *t.points, t.values) for t in tables}
    for name, value in found.coefficients.items():
        np.testing.assert_allclose(value, plain.coefficients[name] - added.get(name, 0.0), atol=1e-12)
    assert all(np.ptp(added[name]) > 1e-3 for name in ("CL", "Cm", "Cl"))
    for name, value in found.regressors.items():
        np.testing.assert_array_equal(value, plain.regressors[name])
    assert set(found.tabulated) == set(added)


@pytest.mark.parametrize(
    ("missing", "column", "said"),
    [
        ("beta", "", "beta not measured.*needs; record it, or use output_error or filter_error, which need no vanes"),
        ("V", "", "V not measured.*needs; record it$"),
        ("de", "", "de not measured.*needs; record it, or take the derivatives by it out of the aircraft file"),
        ("alpha", "AoA", "alpha not measured.*needs; is 'AoA' what is called 'alpha' here"),
    ],
)
def test_what_is_not_measured_is_named_with_a_remedy(missing, column, said):
    record = flight(1)
    columns = {name: values for name, values in record.columns.items() if name != missing}
    columns |= {column: record[missing]} if column else {}
    with pytest.raises(InputError, match=said):
        measured_coefficients(KESTREL, FlightRecord(record.time, columns, "made"))
