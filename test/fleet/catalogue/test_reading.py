"""Catalogues as CSV, YAML and folders: what each entry stands for, and what is wrong with which."""

import datetime
from pathlib import Path

import pytest

from sysid_node.errors import InputError
from sysid_node.fleet.catalogue.reading import date_of, read_catalogue

UTC = datetime.UTC


def logs(folder: Path, *names: str) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("time,p\n0.0,0.1\n")


def test_a_table_with_a_pattern_a_note_and_a_log_that_is_missing(tmp_path: Path) -> None:
    logs(tmp_path, "7/a.csv", "7/b.csv")
    (tmp_path / "fleet.csv").write_text(
        "path,aircraft,tail,configuration,date,maintenance\n"
        "7/*.csv,cdrw,7,pod,,\n"
        "8/c.csv,cdrw,8,,2026-05-03,\n"
        ",,7,,2026-05-10,aileron servo replaced\n"
    )
    found = read_catalogue(tmp_path / "fleet.csv")
    assert [flight.flight for flight in found.flights] == ["7/a.csv", "7/b.csv", "8/c.csv"]
    assert found.flights[0].location == str(tmp_path / "7" / "a.csv")
    assert (found.flights[0].tail, found.flights[0].configuration, found.flights[0].fault) == ("7", "pod", "")
    assert found.flights[2].fault == f"{tmp_path / '8/c.csv'}: does not exist"
    assert found.flights[2].date == datetime.datetime(2026, 5, 3, tzinfo=UTC)
    (note,) = found.maintenance
    assert (note.tail, note.date.day, note.text) == ("7", 10, "aileron servo replaced")


def test_a_pattern_passes_over_what_is_no_flight(tmp_path: Path) -> None:
    logs(tmp_path, "7/a.csv", "7/a.truth.json", "7/notes.txt", "7/bag/bag_0.mcap", "7/bag/metadata.yaml")
    (tmp_path / "7" / "a.truth.json").write_text("{}")
    (tmp_path / "fleet.csv").write_text("path,aircraft,tail\n7/*,cdrw,7\n7/*/*,cdrw,7\n7/a.truth.json,cdrw,8\n")
    found = read_catalogue(tmp_path / "fleet.csv").flights
    assert [flight.flight for flight in found] == ["7/a.csv", "7/bag", "7/bag/bag_0.mcap", "7/a.truth.json"]
    assert "is no flight that can be read" in found[3].fault
    (tmp_path / "all.csv").write_text("path,aircraft,tail\n**/*,cdrw,7\n")
    assert [f.flight for f in read_catalogue(tmp_path / "all.csv").flights if "7" in f.flight] == ["7/a.csv", "7/bag"]


def test_a_pattern_passes_over_the_catalogue_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs(tmp_path, "a.csv", "b.csv")
    (tmp_path / "fleet.csv").write_text("path,aircraft,tail\n*.csv,cdrw,7\n")
    (tmp_path / "beside").mkdir()
    monkeypatch.chdir(tmp_path / "beside")
    for path in (tmp_path / "fleet.csv", Path("../fleet.csv")):
        assert [flight.flight.rpartition("/")[2] for flight in read_catalogue(path).flights] == ["a.csv", "b.csv"]


def test_a_table_with_semicolons_and_one_with_a_column_twice(tmp_path: Path) -> None:
    logs(tmp_path, "a.csv")
    (tmp_path / "fleet.csv").write_text("path;aircraft;tail;maintenance\na.csv;cdrw;7;\n")
    (flight,) = read_catalogue(tmp_path / "fleet.csv").flights
    assert (flight.flight, flight.aircraft, flight.tail) == ("a.csv", "cdrw", "7")
    (tmp_path / "fleet.csv").write_text("path,tail,path\na.csv,7,b.csv\n")
    with pytest.raises(InputError, match="column 'path' is there twice; keep one"):
        read_catalogue(tmp_path / "fleet.csv")


def test_yaml_with_a_default_aircraft_file_beside_it(tmp_path: Path) -> None:
    logs(tmp_path, "a.csv")
    (tmp_path / "fleet.yaml").write_text(
        "aircraft: cdrw\n"
        "flights:\n"
        "  - a.csv\n"
        "  - {path: a.csv, flight: again, aircraft: types/own.yaml, tail: 12, date: 2026-05-03}\n"
        "maintenance:\n"
        "  - {aircraft: types/own.yaml, tail: 12, date: 2026-05-01, text: new wing}\n"
    )
    first, second = read_catalogue(tmp_path / "fleet.yaml").flights
    assert (first.flight, first.aircraft, first.tail) == ("a.csv", "cdrw", "")
    assert (second.flight, second.aircraft, second.tail) == ("again", str(tmp_path / "types/own.yaml"), "12")
    (note,) = read_catalogue(tmp_path / "fleet.yaml").maintenance
    assert (note.text, note.aircraft) == ("new wing", str(tmp_path / "types/own.yaml"))


def test_a_folder_takes_the_aircraft_above_a_log_and_the_tail_of_its_folder(tmp_path: Path) -> None:
    logs(tmp_path, "small/7/a.csv", "small/8/b.csv", "c.csv")
    (tmp_path / "small" / "aircraft.yaml").write_text("name: small\n")
    (tmp_path / "small" / "notes.txt").write_text("wind, gusts\n")
    found = read_catalogue(tmp_path).flights
    assert [(f.flight, f.fallback_tail) for f in found] == [
        ("c.csv", ""),
        ("small/7/a.csv", "7"),
        ("small/8/b.csv", "8"),
    ]
    assert found[1].aircraft == str(tmp_path / "small" / "aircraft.yaml")
    assert "write one, or give --aircraft" in found[0].fault
    assert not read_catalogue(tmp_path, "cdrw").flights[0].fault


def test_a_flight_that_is_there_twice_is_a_fault_of_the_second(tmp_path: Path) -> None:
    logs(tmp_path, "a.csv")
    (tmp_path / "fleet.csv").write_text("path,aircraft\na.csv,cdrw\n*.csv,cdrw\n")
    faults = {flight.flight: flight.fault for flight in read_catalogue(tmp_path / "fleet.csv").flights}
    assert faults["a.csv"] == ""
    assert faults["a.csv#2"] == "a.csv: is in the catalogue 2 times; keep one"


def test_addresses_are_expanded_by_fsspec(tmp_path: Path) -> None:
    logs(tmp_path, "bucket/a.csv", "bucket/b.csv")
    (tmp_path / "fleet.csv").write_text(
        f"path,aircraft,tail\nfile://{tmp_path}/bucket/*.csv,cdrw,7\nnone://x/y.ulg,cdrw,7\n"
    )
    found = read_catalogue(tmp_path / "fleet.csv").flights
    assert [flight.location for flight in found[:2]] == [f"file://{tmp_path}/bucket/{name}.csv" for name in "ab"]
    assert "cannot be opened" in found[2].fault


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("f.csv", "file,aircraft\na,b\n", "line 1: unknown key 'file'"),
        ("f.csv", "t,ax,ay,az,p\n0,0,0,-9.8,0\n", "is a flight itself; give its folder, or a catalogue"),
        ("f.csv", "aircraft,tail\na,b\n", "column 'path' is missing"),
        ("f.csv", "path,tail\na,b,c\n", "line 2: has 3 cells for 2 columns"),
        ("f.csv", "path,tail\n", "has no flights"),
        ("f.csv", "path,tail,maintenance\n,7,oil\n", "line 2: a maintenance needs a tail and a date"),
        ("f.csv", "path,tail,date,maintenance\n,7,May,oil\n", "date 'May': expected YYYY-MM-DD"),
        ("f.yaml", "flights: 3\n", "expected a key 'flights' with a list"),
        ("f.yaml", "flights: [{path: a, tial: 7}]\n", r"flights\[0\]: unknown key 'tial'"),
        ("f.yaml", "flights: [a\n", "is no YAML"),
        ("f.yaml", "flights: [{path: a, date: 2026-13-45}]\n", "is no YAML: month must be in 1..12"),
    ],
)
def test_a_wrong_catalogue_is_one_line(tmp_path: Path, name: str, text: str, said: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=said) as error:
        read_catalogue(tmp_path / name, "cdrw")
    assert "\n" not in str(error.value)


def test_a_wrong_date_is_the_fault_of_its_flight(tmp_path: Path) -> None:
    logs(tmp_path, "a.csv")
    (tmp_path / "fleet.csv").write_text("path,aircraft,date\na.csv,cdrw,yesterday\n")
    (flight,) = read_catalogue(tmp_path / "fleet.csv").flights
    assert "line 2: date 'yesterday': expected YYYY-MM-DD" in flight.fault


def test_a_date_without_a_zone_is_utc() -> None:
    assert date_of("2026-05-03T09:30:00") == datetime.datetime(2026, 5, 3, 9, 30, tzinfo=UTC)
    assert date_of("2026-05-03T11:30:00+02:00") == datetime.datetime(2026, 5, 3, 9, 30, tzinfo=UTC)


def test_names_of_folders_are_plain_and_differ(tmp_path: Path) -> None:
    logs(tmp_path, "a b.csv", "a_b.csv", "x/../x/c.csv")
    folders = [flight.folder for flight in read_catalogue(tmp_path, "cdrw").flights]
    assert len(set(folders)) == 3
    assert all("/" not in folder and " " not in folder for folder in folders)
