"""Flight CSV: read, written, and every mistake said with file, line and column."""

import numpy as np
import pytest

from sysid_node.errors import InputError
from sysid_node.flight.csv import read_csv, write_csv
from sysid_node.flight.record import FlightRecord


def file_with(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_text(text)
    return path


def test_columns_and_empty_cells(tmp_path):
    flight = read_csv(file_with(tmp_path, "t, ax ,thrust,flap\n0,1.5,,0.1\n0.5,2.5,,\n\n"))
    assert flight.time.tolist() == [0.0, 0.5]
    assert flight["ax"].tolist() == [1.5, 2.5]
    assert not flight.measured("thrust")
    np.testing.assert_array_equal(flight["flap"], [0.1, np.nan])
    assert flight.name == "log"


def test_round_trip_to_the_last_bit(tmp_path):
    rng = np.random.default_rng(0)
    columns = {"ax": rng.normal(size=20), "alpha": np.where(rng.random(20) < 0.3, np.nan, rng.normal(size=20) * 1e-9)}
    flight = FlightRecord(np.cumsum(rng.random(20)), columns)
    write_csv(tmp_path / "x.csv", flight)
    back = read_csv(tmp_path / "x.csv")
    np.testing.assert_array_equal(back.time, flight.time)
    for name, values in columns.items():
        np.testing.assert_array_equal(back[name], values)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no column 't'"),
        ("time,ax\n0,1\n", "no column 't'"),
        ("t,ax,ax\n0,1,2\n", "column 'ax' is there twice"),
        ("t,ax\n0,1\n", "1 samples"),
        ("t,ax\n0,1\n1,2,3\n", "line 3 has 3 cells, expected 2"),
        ("t,ax\n0,1\n1,2\n2", "line 4 has 1 cells.*cut short"),
        ("t,ax\n0,1\n1,fast\n", "line 3, column 'ax': got 'fast'"),
        ("t,ax\n0,1\n1,inf\n", "line 3, column 'ax': got 'inf'"),
        ("t,ax\n0,1\n,2\n", "line 3, column 't'"),
        ("t,ax\n0,1\n1,2\n1,3\n", "time must increase; sample 2"),
    ],
)
def test_mistakes_are_one_line_with_the_place(tmp_path, text, said):
    with pytest.raises(InputError, match=said) as caught:
        read_csv(file_with(tmp_path, text))
    assert "log.csv" in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_csv(tmp_path / "none.csv")
    (tmp_path / "binary.csv").write_bytes(b"t,ax\n\xff\xfe\x00")
    with pytest.raises(InputError, match="cannot be read as CSV"):
        read_csv(tmp_path / "binary.csv")


def test_real_flights(flights):
    for path in sorted(flights.glob("*.csv")):
        flight = read_csv(path)
        assert len(flight) > 300
        assert flight.measured("alpha")
        assert -12.0 < np.nanmedian(flight["az"]) < -8.0  # level flight, FRD
