"""What ``sysid check`` says of a file: gaps, clocks, vanes, faults, the part flown, what moves the aircraft."""

import re
from dataclasses import replace

import numpy as np
import pytest
from made_flights import made_aircraft
from simulated_logs import PX4_DEFAULT, dataflash_log, flight, px4_log

from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.csv import write_csv
from sysid_node.flight.logs.checks.survey import survey
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.flight.record import FlightRecord
from sysid_node.flight.streams import COMMAND_FRACTIONS, Streams


def row(found, signal):
    (one,) = (row for row in found.rows if row.signal == signal)
    return one


def streams() -> Streams:
    return streams_from_record(flight().between(2.0, 12.0))


def with_stamps(topic: str, change) -> Streams:
    """The flight with the stamps (N,) of a topic changed by a function of them."""
    whole = streams()
    stream = getattr(whole, topic)
    arrival = replace(stream.arrival, stamp_ns=change(stream.arrival.stamp_ns.copy()))
    return replace(whole, **{topic: replace(stream, arrival=arrival)})


def kept(topic: str, keep) -> Streams:
    """The flight with those messages of a topic that ``keep`` (N,) selects of the seconds since its start."""
    whole = streams()
    stream = getattr(whole, topic)
    some = keep((stream.arrival.stamp_ns - stream.arrival.stamp_ns[0]) / 1e9)
    arrival = replace(stream.arrival, **{n: getattr(stream.arrival, n)[some] for n in ("stamp_ns", "log_ns", "order")})
    return replace(whole, **{topic: replace(stream, arrival=arrival, values=stream.values[some])})


def surveyed(tmp_path, of_streams, aircraft=None):
    write_streams(tmp_path / "bag", of_streams)
    return survey(tmp_path / "bag", aircraft)


def test_gaps_are_counted_and_the_longest_is_told(tmp_path):
    """Truth: from 2 s to 2.5 s and from 5 s to 6.5 s of 10 s no air data came; the last 3.5 s are whole."""
    found = surveyed(tmp_path, kept("air_data", lambda t: ~(((t > 2) & (t < 2.5)) | ((t > 5) & (t < 6.5)))))
    assert row(found, "airspeed").gaps in {"2, longest 1.50 s", "2, longest 1.51 s"}
    assert row(found, "IMU").gaps == "none"
    assert found.uninterrupted == pytest.approx(3.5, abs=0.02)


def test_a_clock_that_was_set_back(tmp_path):
    def back(stamps):
        stamps[stamps.size // 2 :] -= 3_000_000_000
        return stamps

    found = surveyed(tmp_path, with_stamps("imu", back))
    assert row(found, "IMU").clock == "goes back by 3.0 s"
    assert found.two_clocks == "the stamps of imu/data go back by 3.0 s; cut the recording there"
    assert found.refusal.reasons == ()


def test_stamps_that_are_repeated_or_late(tmp_path):
    """Truth: message 100 has the stamp of the one before it, and 200 one that is 0.2 s late."""

    def odd(stamps):
        stamps[100] = stamps[99]
        stamps[200] -= 200_000_000
        return stamps

    found = surveyed(tmp_path, with_stamps("air_data", odd))
    assert row(found, "airspeed").clock == "2 stamps repeated or late"
    assert row(found, "IMU").clock == "good"
    assert found.two_clocks == ""


def test_a_log_with_two_clocks_is_of_no_use(tmp_path):
    px4_log(tmp_path / "flight.ulg", jump=-30.0)
    found = survey(tmp_path / "flight.ulg")
    assert row(found, "IMU").clock == "goes back by 30.0 s"
    assert row(found, "IMU").verdict == "unusable"
    assert "go back by 30.0 s after 10.0 s (a clock was set); cut the log there" in found.refusal.text


def test_vanes_have_a_row_where_they_measured(tmp_path):
    px4_log(tmp_path / "with.ulg", vanes={"aoa": (99.0, 99.0)})
    px4_log(tmp_path / "without.ulg")
    found, without = survey(tmp_path / "with.ulg"), survey(tmp_path / "without.ulg")
    assert (row(found, "vanes").source, row(found, "vanes").verdict) == ("airflow_aoa", "ok")
    assert found.angles == ("alpha",)
    assert without.angles == ()
    assert "vanes" not in {row.signal for row in without.rows}


def test_a_bag_without_flow_angles_has_no_vanes(tmp_path):
    whole = streams()
    values = whole.air_data.values.copy()
    values[:, 1:3] = np.nan
    found = surveyed(tmp_path, replace(whole, air_data=replace(whole.air_data, values=values)))
    assert found.angles == ()
    assert "vanes" not in {row.signal for row in found.rows}


@pytest.mark.parametrize("kind", ["PX4", "ArduPilot"])
def test_only_the_part_flown_is_told_of(tmp_path, kind):
    """Truth: 7 s in the air of 20 s."""
    if kind == "PX4":
        px4_log(tmp_path / "flight", aloft=(5.0, 12.0))
    else:
        dataflash_log(tmp_path / "flight", states={"STAT": [(0.0, 0), (5.0, 1), (12.0, 0)]})
    found = survey(tmp_path / "flight")
    assert found.seconds == pytest.approx(7.0, abs=0.05)
    assert "flown as a fixed wing: 7.0 of 20.0 s (5.0 to 12.0 s); the rest is left out" in found.remarks


def test_a_log_on_the_ground_is_of_no_use(tmp_path):
    dataflash_log(tmp_path / "flight.bin", flying=0)
    found = survey(tmp_path / "flight.bin")
    assert row(found, "IMU").verdict == "unusable"
    assert found.refusal.text.startswith("ArduPlane V4.5.0 never flew as a fixed wing in it")


def test_of_a_slow_log_the_rate_and_the_setting_are_told(tmp_path):
    px4_log(tmp_path / "flight.ulg", PX4_DEFAULT)
    found = survey(tmp_path / "flight.ulg")
    assert row(found, "controls").verdict == "20 Hz needed"
    assert row(found, "airspeed").verdict == "ok"
    assert found.remedies == (found.refusal.remedies[0],)


def with_air_data_at(rate: float, later: float = 0.0) -> Streams:
    """The flight with air data at a ``rate`` (Hz), 1 ms after IMU messages, every other one ``later`` by so many s."""

    def keep(t):
        wanted = np.arange(0.0, t[-1], 1.0 / rate)
        wanted[1::2] += later
        chosen = np.zeros(t.size, bool)
        chosen[np.searchsorted(t, wanted - 1e-3)] = True
        return chosen

    thinned = kept("air_data", keep)
    arrival = replace(thinned.air_data.arrival, stamp_ns=thinned.air_data.arrival.stamp_ns + 1_000_000)
    return replace(thinned, air_data=replace(thinned.air_data, arrival=arrival))


def test_air_data_that_come_too_seldom_to_interpolate_between_are_told_with_the_rate_that_is_needed(tmp_path):
    """Truth: at 4 Hz all messages are 0.25 s apart, and 0.2 s is the longest gap that is bridged."""
    found = surveyed(tmp_path, with_air_data_at(4.0))
    assert row(found, "airspeed").verdict == "over 5 Hz needed"
    assert row(found, "air density").verdict == "over 5 Hz needed"
    assert row(found, "IMU").verdict == row(found, "controls").verdict == "ok"
    assert "air_data comes at 4 Hz, and more than 5 Hz are needed: all of the IMU's messages" in found.sparse


def test_air_data_for_which_a_part_is_left_out_are_taken_with_a_remark(tmp_path):
    """Truth: steps of 0.19 s and 0.21 s take turns, and the IMU messages in the longer ones are left out: 52 %."""
    found = surveyed(tmp_path, with_air_data_at(5.0, later=0.01))
    assert row(found, "airspeed").verdict == "over 5 Hz needed"
    assert found.sparse == ""
    (remark,) = (remark for remark in found.remarks if "left out" in remark)
    said = re.search(r"needed: (\d+) % of the IMU's messages are left out", remark)
    assert float(said[1]) == pytest.approx(52.5, abs=2.5)


def test_air_data_that_come_just_often_enough_are_ok(tmp_path):
    found = surveyed(tmp_path, with_air_data_at(6.25))
    assert row(found, "airspeed").verdict == "ok"
    assert (found.sparse, [remark for remark in found.remarks if "left out" in remark]) == ("", [])


def test_a_table_is_taken_at_any_rate(tmp_path):
    record = flight().between(2.0, 12.0)
    every = np.arange(0, len(record), 20)  # 10 Hz
    write_csv(tmp_path / "a.csv", FlightRecord(record.time[every], {n: c[every] for n, c in record.columns.items()}))
    found = survey(tmp_path / "a.csv")
    assert {row.verdict for row in found.rows} == {"ok"}
    assert found.refusal.reasons == ()
    assert "imu/data comes at 10 Hz; 20 Hz are needed of an autopilot's log" in found.remarks


def test_fractions_need_the_deflection_at_full_command(tmp_path):
    whole = streams()
    fractions = replace(whole.actuators, content=COMMAND_FRACTIONS, positions=whole.actuators.positions / 30.0)
    found = surveyed(tmp_path, replace(whole, actuators=fractions))
    assert found.needs == ("full_deflection",)
    assert "% of elevator" in found.excitation["pitch"]


def test_joints_are_the_aircrafts_controls_where_it_is_known(tmp_path):
    """The made aircraft's aileron is a difference of the joints ``left`` and ``right``."""
    streams_of_joints = streams_from_record(flight().between(2.0, 12.0), made_aircraft())
    write_streams(tmp_path / "bag", streams_of_joints)
    known, unknown = survey(tmp_path / "bag", made_aircraft()), survey(tmp_path / "bag")
    assert "deg of aileron" in known.excitation["roll"]
    assert "p b/2V" in known.excitation["roll"]
    assert any(f"deg of {side}" in unknown.excitation["roll"] for side in ("left", "right"))
    assert "b/2V" not in unknown.excitation["roll"]
