"""``sysid fleet``: real flights on a real worker, nothing twice, and one line for whatever is wrong."""

import csv
import fcntl
import json
import os
import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from made_flights import made_aircraft, made_streams

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.api import load, replay
from sysid_node.cli.main import main
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.streams import Arrival

LINES = ["--frequencies", "0.2:0.2:2.0"]


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two flights of two tails, a log that is none, a catalogue, and the fleet's results in ``out``."""
    folder = tmp_path_factory.mktemp("fleet")
    for seed, name in enumerate("ab"):
        write_streams(folder / name, made_streams(12.0, seed))
    (folder / "c.ulg").write_bytes(b"ULog\x01\x12\x35\x01damaged")
    (folder / "made.yaml").write_text(dump_aircraft(made_aircraft()))
    (folder / "fleet.csv").write_text(
        "path,aircraft,tail,configuration,date,maintenance\n"
        "a,made.yaml,7,,2026-05-03,\n"
        "b,made.yaml,8,pod,2026-05-04T10:00:00Z,\n"
        "c.ulg,made.yaml,8,,2026-05-05,\n"
        ",made.yaml,7,,2026-05-01,new servo\n"
        ",,70,,2026-05-01,of no flight\n"
    )
    assert main(arguments(folder)) == 0
    return folder


def arguments(folder: Path, *more: str) -> list[str]:
    given = ["fleet", str(folder / "fleet.csv"), "--out", str(folder / "out"), "--workers", "1", "--quiet"]
    return [*given, *LINES, *more]


def finished(folder: Path) -> dict[str, tuple[str, str]]:
    """When each flight of the state file was finished, and as what."""
    connection = sqlite3.connect(folder / "out" / "fleet.sqlite")
    rows = connection.execute("SELECT flight, status, finished FROM flights").fetchall()
    connection.close()
    return {flight: (status, when) for flight, status, when in rows}


@pytest.mark.slow
def test_a_fleet_gives_the_replays_estimates_with_their_covariance(fleet: Path) -> None:
    found = json.loads((fleet / "out" / "fleet.json").read_text())
    assert [(f["flight"], f["tail"], f["configuration"]) for f in found["flights"]] == [
        ("a", "7", ""),
        ("b", "8", "pod"),
    ]
    assert [refusal["flight"] for refusal in found["refusals"]] == ["c.ulg"]
    assert "c.ulg" in found["refusals"][0]["reason"]
    assert found["maintenance"] == [
        {"aircraft": "made", "tail": "7", "date": "2026-05-01T00:00:00+00:00", "text": "new servo"},
        {"aircraft": "", "tail": "70", "date": "2026-05-01T00:00:00+00:00", "text": "of no flight"},
    ]
    flight = load(fleet / "a", fleet / "made.yaml")
    single = replay(flight, {"frequencies": "0.2:0.2:2.0", "publish_rate": 1.0}, judge_faults=False)
    rows = [row for row in csv.DictReader((fleet / "out" / "estimates.csv").open()) if row["flight"] == "a"]
    assert [row["derivative"] for row in rows] == list(single.derivatives)
    for row in rows:
        estimate = single.derivatives[row["derivative"]]
        assert float(row["value"]) == estimate.value
        assert float(row["standard_error"]) == pytest.approx(estimate.standard_error, rel=1e-9)
        assert float(row["systematic_error"]) == pytest.approx(estimate.systematic_error, rel=1e-6, abs=1e-12)
        assert (row["valid"] == "True") == estimate.valid
    covariance = pq.read_table(fleet / "out" / "covariances.parquet").to_pylist()
    covariance = [row for row in covariance if row["flight"] == "a"]
    assert covariance
    assert single.covariance is not None
    names, total = single.covariance.names, single.covariance.total
    for row in covariance:
        expected = total[names.index(row["first"]), names.index(row["second"])]
        assert row["covariance"] == pytest.approx(expected, rel=1e-9, abs=1e-15)


@pytest.mark.slow
def test_tables_are_the_same_as_csv_and_as_parquet(fleet: Path) -> None:
    for name in ("flights", "estimates", "refusals"):
        with (fleet / "out" / f"{name}.csv").open() as file:
            rows = list(csv.DictReader(file))
        table = pq.read_table(fleet / "out" / f"{name}.parquet").to_pylist()
        assert len(rows) == len(table)
        for row, other in zip(rows, table, strict=True):
            assert row.keys() == other.keys()
            assert row["flight"] == other["flight"]
    values = [float(row["value"]) for row in csv.DictReader((fleet / "out" / "estimates.csv").open())]
    np.testing.assert_array_equal(values, pq.read_table(fleet / "out" / "estimates.parquet")["value"].to_numpy())


def test_started_again_it_does_nothing_twice(fleet: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = finished(fleet)
    assert {flight: status for flight, (status, _) in before.items()} == {"a": "done", "b": "done", "c.ulg": "refused"}
    assert main(arguments(fleet)) == 0
    assert finished(fleet) == before
    assert main(arguments(fleet, "--dry-run")) == 0
    assert "0 to do, 3 done, 0 with a fault" in capsys.readouterr().out
    log, state = next((fleet / "b").glob("*.mcap")), (fleet / "out" / "fleet.sqlite").read_bytes()
    os.utime(log)  # the content is the same
    assert main(arguments(fleet, "--dry-run", "--set", "window=8")) == 0
    assert "3 to do, 0 done" in capsys.readouterr().out
    assert (fleet / "out" / "fleet.sqlite").read_bytes() == state  # a dry run writes nothing


def test_a_dry_run_says_what_is_wrong_with_which_flight(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "fleet.csv").write_text("path,aircraft,tail\nnone.ulg,cdrw,7\nfleet.csv,no_such,7\n")
    assert main(arguments(tmp_path, "--dry-run")) == 0
    said = capsys.readouterr().out
    assert "none.ulg: does not exist" in said
    assert "aircraft 'no_such' is not known" in said
    assert "0 to do, 0 done, 2 with a fault" in said
    assert not (tmp_path / "out").exists()


def test_a_log_that_is_there_twice_counts_once(fleet: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(fleet / "a", fleet / "copy")
    given = (fleet / "fleet.csv").read_text()
    (fleet / "twice.csv").write_text(given + "copy,made.yaml,7,,2026-05-09,\n")
    assert main([*arguments(fleet)[:1], str(fleet / "twice.csv"), *arguments(fleet)[2:]]) == 0
    found = json.loads((fleet / "out" / "fleet.json").read_text())
    assert [flight["flight"] for flight in found["flights"]] == ["a", "b"]
    reasons = {refusal["flight"]: refusal["reason"] for refusal in found["refusals"]}
    assert reasons["copy"] == "copy: is the same log as a, and would count twice; keep one"
    assert main([*arguments(fleet)[:1], str(fleet / "twice.csv"), *arguments(fleet, "--dry-run")[2:]]) == 0
    assert "0 to do, 3 done, 1 with a fault" in capsys.readouterr().out


@pytest.mark.slow
def test_files_of_one_type_may_differ_in_all_but_the_geometry(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = (fleet / "made.yaml").read_text()
    (tmp_path / "heavy.yaml").write_text(
        made.replace("mass: 2.0", "mass: 2.2").replace("{value: -0.9}", "{value: -0.8}")
    )
    (tmp_path / "large.yaml").write_text(made.replace("S: 0.4", "S: 0.8"))
    (tmp_path / "fleet.csv").write_text(
        "path,flight,aircraft,tail,date\n"
        f"{fleet / 'a'},a,{fleet / 'made.yaml'},7,2026-05-03\n"
        f"{fleet / 'b'},b,heavy.yaml,8,2026-05-03\n"
        f"{fleet / 'b'},c,large.yaml,9,2026-05-03\n"
    )
    assert main([word for word in arguments(tmp_path) if word != "--quiet"]) == 0
    warning = "the files of type made do not state Cm_de alike: not compared with the flights"
    assert warning in capsys.readouterr().err
    found = json.loads((tmp_path / "out" / "fleet.json").read_text())
    (refusal,) = found["refusals"]
    assert "names its aircraft 'made' like " in refusal["reason"]
    assert "another geometry" in refusal["reason"]


@pytest.mark.slow
def test_what_a_single_flights_command_warns_of_is_said_here_too(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = made_streams(12.0)
    streams = (made.imu, made.air_data, made.actuators)
    imu, air_data, actuators = (replace(s, arrival=replace(s.arrival, log_ns=set_ahead(s.arrival))) for s in streams)
    write_streams(tmp_path / "c", replace(made, imu=imu, air_data=air_data, actuators=actuators))
    (tmp_path / "fleet.csv").write_text(
        f"path,aircraft,tail,date,maintenance\nc,{fleet / 'made.yaml'},7,2026-05-03,\n,,70,2026-05-01,of no flight\n"
    )
    assert main([word for word in arguments(tmp_path) if word != "--quiet"]) == 0
    said = capsys.readouterr()
    assert "  warning of c: bag c: the recorder's clock jumps by 300 s" in said.out
    assert "maintenance of 70 on 2026-05-01 (of no flight): no flight of such a tail has a result" in said.err
    assert "the recorder&#39;s clock jumps by 300 s" in (tmp_path / "out" / "report.html").read_text()
    (row,) = csv.DictReader((tmp_path / "out" / "flights.csv").open())
    assert row["remarks"].startswith("bag c: the recorder's clock jumps by 300 s")


def set_ahead(arrival: Arrival) -> np.typing.NDArray[np.int64]:
    """The recorder's stamps, ns, with its clock set 300 s ahead in the middle of the flight."""
    return np.asarray(arrival.log_ns + 300 * 10**9 * (arrival.stamp_ns > 106 * 10**9))


def test_of_two_commands_on_one_folder_the_second_says_so(fleet: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lock = os.open(fleet / "out", os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        assert main(arguments(fleet)) == 2
    finally:
        os.close(lock)
    assert "another run is writing into it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--set", "widow=3"), "widow"),
        (("--workers", "0"), "--workers 0: expected 1 to 1000"),
        (("--time-limit", "0"), "--time-limit 0: expected a number of seconds"),
        (("--retries", "-1"), "--retries -1: expected 0 to 100"),
        (("--dry-run", "--memory", "2XB"), "--memory '2XB': expected a size, e.g. 2GB"),
    ],
)
def test_a_wrong_option_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], said: str
) -> None:
    (tmp_path / "fleet.csv").write_text("path,aircraft,tail\nfleet.csv,cdrw,7\n")
    assert main(arguments(tmp_path, *more)) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_fleet_without_a_result_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "fleet.csv").write_text("path,aircraft,tail\nnone.ulg,cdrw,7\n")
    assert main(arguments(tmp_path)) == 2
    assert "no flight of the catalogue gave a result; the first: " in capsys.readouterr().err
    assert (tmp_path / "out" / "refusals.csv").exists()
