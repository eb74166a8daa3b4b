"""Logs as messages and back: a flight comes out of a bag as it went in."""

import dataclasses

import numpy as np
import pytest
from made_flights import made_aircraft

from sysid_node.errors import InputError
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.csv import read_csv
from sysid_node.flight.logs.opening import load_flight_record
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.flight.record import FlightRecord

AIRCRAFT = made_aircraft()


def made_flight(count: int = 60) -> FlightRecord:
    rng = np.random.default_rng(2)
    names = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi", "alpha", "beta", "de", "da", "dr")
    columns = {name: rng.uniform(-0.3, 0.3, count) for name in names}
    columns |= {"V": rng.uniform(15, 20, count), "rho": np.full(count, 1.1), "thrust": rng.uniform(5, 25, count)}
    return FlightRecord(5.0 + np.round(np.cumsum(rng.uniform(0.008, 0.012, count)), 9), columns, "made")


def assert_same(back: FlightRecord, flight: FlightRecord, atol: float) -> None:
    np.testing.assert_allclose(back.time, flight.time - flight.time[0], atol=1e-12)
    for name, values in flight.columns.items():
        np.testing.assert_allclose(back[name], values, atol=1e-9 if name in {"phi", "theta", "psi"} else atol)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_through_a_bag_with_the_aircrafts_joints(tmp_path, storage):
    flight = made_flight()
    write_streams(tmp_path / "bag", streams_from_record(flight, AIRCRAFT), storage)
    back = load_flight_record(tmp_path / "bag", AIRCRAFT)
    assert_same(back, flight, 1e-12)
    assert back.rejected == {}


def test_standard_joints_carry_the_controls_and_thrust_in_newton():
    joints = streams_from_record(made_flight()).actuators
    assert joints.names == ("elevator", "aileron", "rudder", "throttle")
    np.testing.assert_array_equal(joints.positions[:, 3], made_flight()["thrust"])


def test_what_was_not_measured_is_left_out():
    flight = made_flight()
    columns = {name: values for name, values in flight.columns.items() if name not in {"thrust", "dr", "psi"}}
    streams = streams_from_record(FlightRecord(flight.time, columns))
    assert streams.actuators.names == ("elevator", "aileron")
    assert np.isnan(streams.imu.attitude[:, 2]).all()


@pytest.mark.parametrize("start_ns", [0, 1_700_000_000_000_000_000])
def test_stamps_start_at_the_flights_date(start_ns):
    flight = dataclasses.replace(made_flight(), start_ns=start_ns)
    stamps = streams_from_record(flight).imu.arrival.stamp_ns
    assert stamps[0] == (start_ns or 1_000_000_000) + round(flight.time[0] * 1e9)
    np.testing.assert_array_equal(np.diff(stamps), np.diff(np.round(flight.time * 1e9)))
    negative = dataclasses.replace(flight, time=flight.time - 1000.0, start_ns=0)
    assert streams_from_record(negative).imu.arrival.stamp_ns[0] > 0


def test_lack_of_what_a_bag_needs_is_named():
    flight = made_flight()
    with pytest.raises(InputError, match="no values in V"):
        streams_from_record(FlightRecord(flight.time, {k: v for k, v in flight.columns.items() if k != "V"}))
    no_controls = {k: v for k, v in flight.columns.items() if k not in {"de", "da", "dr", "thrust"}}
    with pytest.raises(InputError, match="de, da, dr or thrust"):
        streams_from_record(FlightRecord(flight.time, no_controls))
    with pytest.raises(InputError, match="no values in de, da, dr, which made has"):
        streams_from_record(FlightRecord(flight.time, no_controls), AIRCRAFT)


def test_real_flights_through_bags(tmp_path, flights):
    """Every complete sample of a real flight survives the way through a bag unchanged."""
    controls = {name: dataclasses.replace(c, joints={name: 1.0}, offset=0.0) for name, c in AIRCRAFT.controls.items()}
    aircraft = dataclasses.replace(
        AIRCRAFT, controls=controls, throttle=dataclasses.replace(AIRCRAFT.throttle, max_thrust=None)
    )
    for name in ("twin_otter_018", "hfb320", "attas_lateral_1"):
        flight = read_csv(flights / f"{name}.csv")
        write_streams(tmp_path / name, streams_from_record(flight))
        back = load_flight_record(tmp_path / name, aircraft)
        assert len(back) == len(flight)
        for column in ("ax", "az", "q", "V", "alpha", "beta", "thrust", "de", "da", "dr"):
            np.testing.assert_array_equal(back[column], flight[column])
