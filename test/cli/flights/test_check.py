"""``sysid check``: one table a log, what to change, and exactly what the other commands do with it."""

import sys
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import pytest
from mavros_bag import OUTPUTS, mavros_bag
from simulated_logs import BAG, FULL_RATES, PX4_DEFAULT, aircraft, dataflash_log, flight, picked, px4_log

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.batch.identify import METHODS
from sysid_node.cli.flights.verdicts import SHORTEST_FOR_GAP, verdicts
from sysid_node.cli.main import main
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.csv import write_csv
from sysid_node.flight.logs.checks.survey import survey
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.flight.record import FlightRecord


def test_a_good_log_and_a_slow_one(tmp_path, capsys):
    px4_log(tmp_path / "good.ulg")
    px4_log(tmp_path / "slow.ulg", PX4_DEFAULT)
    assert main(["check", str(tmp_path / "good.ulg"), str(tmp_path / "slow.ulg")]) == 0
    good, slow = capsys.readouterr().out.split("slow.ulg")
    where = "yes, where the aircraft file states full_deflection of each control"
    assert f"replay, gap: {where}, without vanes" in good
    assert f"identify: {where}, by output_error, filter_error, *_kalman_filter; the other methods need" in good
    assert "actuator_servos" in good
    assert "change" not in good
    assert "replay, identify, gap, faults: no: actuator_servos comes at 10 Hz; 20 Hz are needed; SDLOG_PROFILE" in slow
    assert "change    SDLOG_PROFILE = 27" in slow
    assert "pitch: well" in slow


def test_ardupilots_setting_is_named(tmp_path, capsys):
    dataflash_log(tmp_path / "flight.bin", {**FULL_RATES, "controls": 10.0})
    assert main(["check", str(tmp_path / "flight.bin")]) == 0
    assert "LOG_BITMASK: set bit 13" in capsys.readouterr().out


def test_the_others_are_shown_before_what_cannot_be_read_is_refused(tmp_path, capsys):
    (tmp_path / "empty.ulg").write_bytes(b"")
    px4_log(tmp_path / "good.ulg", drop=("airspeed_validated",))
    assert main(["check", str(tmp_path / "empty.ulg"), str(tmp_path / "good.ulg")]) == 2
    out, err = capsys.readouterr()
    assert "no airspeed in it" in out
    assert "empty.ulg: is empty" in err
    assert err.count("\n") == 1


def test_a_log_without_an_imu_is_shown(tmp_path, capsys):
    """Truth: the message that it lacks."""
    px4_log(tmp_path / "flight.ulg", drop=("sensor_combined",))
    assert main(["check", str(tmp_path / "flight.ulg")]) == 0
    assert "replay, identify, gap, faults: no: no sensor_combined in it; SDLOG_PROFILE" in capsys.readouterr().out


def test_an_unexpected_fault_does_not_hide_the_other_files(tmp_path, capsys):
    """A link that leads to itself, which Python refuses with an error of its own."""
    px4_log(tmp_path / "good.ulg")
    (tmp_path / "empty.ulg").write_bytes(b"")
    (tmp_path / "odd.ulg").symlink_to("odd.ulg")
    files = [str(tmp_path / name) for name in ("odd.ulg", "good.ulg", "empty.ulg")]
    assert main(["check", *files]) == 1
    out, err = capsys.readouterr()
    assert "good.ulg: PX4 1.14.0, 20.0 s" in out
    assert "odd.ulg: RuntimeError: Symlink loop" in err
    assert "empty.ulg: is empty" in err
    assert err.count("\n") == 1


def thinned(rate: float, seconds: float) -> FlightRecord:
    """The flight as a table holds it, at a rate (Hz)."""
    whole = flight().between(2.0, 2.0 + seconds)
    kept = picked(whole, rate)
    return FlightRecord(whole.time[kept], {name: column[kept] for name, column in whole.columns.items()}, "thinned")


def table(folder: Path, *, rate: float = 50.0, seconds: float = 8.0) -> Path:
    write_csv(folder / "flight.csv", thinned(rate, seconds))
    return folder / "flight.csv"


def lacking(folder: Path, *columns: str) -> Path:
    """A table in which nothing was measured in some columns."""
    record = thinned(50.0, 8.0)
    columns = {**record.columns, **{name: np.full(len(record), np.nan) for name in columns}}
    write_csv(folder / "flight.csv", replace(record, columns=columns))
    return folder / "flight.csv"


def bag(folder: Path, *, back: bool = False) -> Path:
    """A bag of our own topics, whose clock is set back by 30 s in its midst where ``back``."""
    streams = streams_from_record(thinned(50.0, 10.0), aircraft())
    if back:
        changed = {}
        for name in ("imu", "air_data", "actuators"):
            stream = getattr(streams, name)
            stamps = stream.arrival.stamp_ns.copy()
            stamps[stamps.size // 2 :] -= 30_000_000_000
            changed[name] = replace(stream, arrival=replace(stream.arrival, stamp_ns=stamps + 40_000_000_000))
        streams = replace(streams, **changed)
    write_streams(folder / "bag", streams)
    return folder / "bag"


def mavros(folder: Path, rate: float = 100.0) -> Path:
    mavros_bag(folder / "mavros", rate, 8.0)
    return folder / "mavros"


def px4(folder: Path) -> Path:
    px4_log(folder / "flight.ulg", PX4_DEFAULT)
    return folder / "flight.ulg"


#: How each flight is made, whether the aircraft file states outputs, and which commands take it.
FLIGHTS = {
    "a table": (table, True, ("replay", "identify", "gap")),
    "a table at 10 Hz": (lambda folder: table(folder, rate=10.0), True, ("replay", "identify", "gap")),
    "a short table": (lambda folder: table(folder, seconds=3.0), True, ("replay", "identify")),
    "a very short table": (lambda folder: table(folder, rate=200.0, seconds=0.9), True, ()),
    "a table of a second": (lambda folder: table(folder, rate=200.0, seconds=1.2), True, ("replay", "identify")),
    "a longitudinal table": (lambda folder: lacking(folder, "ay", "p", "r", "beta", "da", "dr"), True, ("gap",)),
    "a table without rudder": (lambda folder: lacking(folder, "dr"), True, ()),
    "a table without density": (lambda folder: lacking(folder, "rho"), True, ("replay", "identify")),
    "a table without airspeed": (lambda folder: lacking(folder, "V"), True, ()),
    "a bag": (bag, True, ("replay", "identify", "gap")),
    "a bag with two clocks": (lambda folder: bag(folder, back=True), True, ("replay",)),
    "MAVROS": (mavros, True, ("replay", "identify", "gap")),
    "MAVROS without outputs": (mavros, False, ()),
    "MAVROS at 10 Hz": (lambda folder: mavros(folder, 10.0), True, ()),
    "a slow log": (px4, True, ()),
}
COMMANDS = {"replay", "identify", "gap"}


def taken_by(text: str) -> set[str]:
    """The commands whose line begins with yes."""
    lines = [line.split("good for", 1)[1].strip() for line in text.splitlines() if "good for" in line]
    pairs = [line.split(": ", 1) for line in lines]
    return {name for names, words in pairs if words.startswith("yes") for name in names.split(", ")} & COMMANDS


@pytest.mark.slow
@pytest.mark.parametrize("kind", FLIGHTS)
def test_the_verdict_is_what_the_commands_do(tmp_path, capsys, kind):
    """Truth: the commands themselves are run; of ``gap``, whose diagnosis takes long, the reading.

    ``identify`` takes long without vanes, which MAVROS has none of; the test of its methods below is of such a flight.
    """
    from sysid_node.errors import InputError  # noqa: PLC0415
    from sysid_node.gap.flightdata.gap_flight import load_gap_flights  # noqa: PLC0415

    make, outputs, takers = FLIGHTS[kind]
    path = make(tmp_path)
    known = replace(aircraft(), outputs=OUTPUTS if outputs and "mavros" in path.name else "")
    (tmp_path / "aircraft.yaml").write_text(dump_aircraft(known), encoding="utf-8")
    file = ["--aircraft", str(tmp_path / "aircraft.yaml")]
    assert main(["check", str(path), *file]) == 0
    assert taken_by(capsys.readouterr().out) == set(takers)

    common = [str(path), *file, "--quiet", "--out"]
    done = {"replay": main(["replay", *common, str(tmp_path / "replay"), "--set", "publish_rate=1"]) == 0}
    if "mavros" in path.name:
        done["identify"] = "identify" in takers
    else:
        done["identify"] = main(["identify", *common, str(tmp_path / "id"), "--method", "equation_error"]) == 0
    try:
        load_gap_flights(path, known, None, "flu")
        done["gap"] = True
    except InputError:
        done["gap"] = False
    assert {command for command, taken in done.items() if taken} == set(takers)


@pytest.mark.parametrize("kind", [k for k in FLIGHTS if "rudder" not in k and "MAVROS" not in k])
def test_the_verdict_without_an_aircraft_file_is_the_same(tmp_path, capsys, kind):
    make, _, takers = FLIGHTS[kind]
    assert main(["check", str(make(tmp_path))]) == 0
    assert taken_by(capsys.readouterr().out) == set(takers)


def test_what_the_aircraft_file_must_state_is_said(tmp_path, capsys):
    assert main(["check", str(mavros(tmp_path))]) == 0
    out = capsys.readouterr().out
    assert "yes, where the aircraft file states outputs (which output moves which joint), without vanes" in out
    assert "by out2" in out


def test_a_transport_is_excited_by_its_elevator(flights, capsys):
    """HFB-320: a 3-2-1-1 of the elevator at 10 Hz, 0.6 deg/s in pitch; ailerons and rudder stood still."""
    assert main(["check", str(flights / "hfb320.csv")]) == 0
    out = capsys.readouterr().out
    assert "pitch: well, 0.6 deg/s" in out
    assert "roll: hardly" in out
    assert "replay, identify, gap: yes, with vanes" in out
    assert "imu/data comes at 10 Hz; 20 Hz are needed of an autopilot's log" in out


@pytest.mark.slow
def test_methods_without_vanes_are_those_that_are_told(tmp_path, capsys):
    """Truth: a table without angle of attack is given to every method that is not told, and to one that is."""
    record = thinned(50.0, 8.0)
    path = tmp_path / "flight.csv"
    write_csv(path, replace(record, columns={**record.columns, "alpha": np.full(len(record), np.nan)}))
    assert main(["check", str(path), "--aircraft", "cdrw"]) == 0
    out = capsys.readouterr().out
    words = out.partition("identify: yes, by ")[2].partition(";")[0].split(", ")
    told = [method for method in METHODS if any(fnmatch(method, word) for word in words)]
    assert len(told) == 5
    options = ["identify", str(path), "--aircraft", "cdrw", "--out", str(tmp_path / "out"), "--quiet", "--method"]
    for method in (*(method for method in METHODS if method not in told), "output_error"):
        quickly = ["--set", "rate=20"] if method in told else []
        assert (main([*options, method, *quickly]) == 0) == (method in told), method
    assert "replay, gap: yes, with one vane: the angle of attack is inferred" in out


def test_an_aircraft_file_makes_rates_non_dimensional(tmp_path, capsys):
    """Truth: the rates' standard deviations times b/2V and cbar/2V."""
    path = table(tmp_path)
    assert main(["check", str(path), "--aircraft", "cdrw"]) == 0
    out = capsys.readouterr().out
    record, size = thinned(50.0, 8.0), aircraft().geometry
    for symbol, length in (("p", "b"), ("q", "cbar"), ("r", "b")):
        half = getattr(size, length) / (2.0 * np.mean(record["V"]))
        assert f"({symbol} {length}/2V {np.std(record[symbol]) * half:.2g})" in out


def test_a_package_that_is_missing_refuses_its_commands_alone(tmp_path, capsys, monkeypatch):
    """On a companion computer JAX is not installed; ``replay`` does not need it."""
    monkeypatch.setitem(sys.modules, "sysid_node.gap.flightdata.gap_flight", None)
    monkeypatch.setitem(sys.modules, "sysid_node.batch.regression.measured_coefficients", None)
    assert main(["check", str(table(tmp_path)), "--aircraft", "cdrw"]) == 0
    out = capsys.readouterr().out
    assert taken_by(out) == {"replay"}
    assert out.count("which is not installed; run: pip install -r requirements/desk.txt") == 2


def test_faults_are_looked_for_in_flights_that_are_long_enough(tmp_path, capsys):
    """Truth: what a replay of the short flight says of its faults."""
    path = table(tmp_path)
    assert main(["check", str(path), str(BAG)]) == 0
    short, long = capsys.readouterr().out.split("rosbag2 recording")
    assert "faults: no: 8.0 s; more than 20 s are needed to learn what sound flight is like" in short
    assert "faults: yes\n" in long
    words = ["replay", str(path), "--aircraft", "cdrw", "--set", "publish_rate=1"]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    assert "no faults were looked for: the flight is too short" in capsys.readouterr().out


def test_without_vanes_their_faults_are_not_looked_for():
    found = survey(BAG)
    none = dict.fromkeys(("replay", "identify", "gap", "faults"), "")
    told = verdicts(replace(found, angles=()), none, aircraft_known=True)
    assert told["faults"] == "yes, of surfaces and of the airframe; not of vanes"
    assert told["replay, gap"] == "yes, without vanes: the angle of attack and the sideslip are inferred"
    assert told["identify"].startswith("yes, by output_error, filter_error, *_kalman_filter")


def test_the_shortest_flight_is_that_of_the_gap():
    from sysid_node.gap.flightdata.gap_flight import SHORTEST_FLIGHT  # noqa: PLC0415

    assert SHORTEST_FOR_GAP == SHORTEST_FLIGHT
