"""Flight CSV: read, written, and every mistake said with file, line and column."""

import numpy as np
import pytest

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.csv import read_csv, write_csv
from sysid_node.flight.record import COLUMNS, FlightRecord


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
        ("t,ax\n0,1\n1,2\n1,3\n", "line 4: time 1 s follows 1 s, and of 3 samples 1 do not increase; sort the lines"),
    ],
)
def test_mistakes_are_one_line_with_the_place(tmp_path, text, said):
    with pytest.raises(InputError, match=said) as caught:
        read_csv(file_with(tmp_path, text))
    assert "log.csv" in str(caught.value)


def test_the_few_samples_whose_time_does_not_increase_are_left_out_and_counted(tmp_path):
    """As a log has them whose clock was corrected; truth: the same file without them."""
    rows = [f"{k / 100:.2f},{k}" for k in range(200)]
    wrong = [*rows[:50], rows[49], *rows[50:120], "0.90,7", *rows[120:]]
    head = "t,ax,ay,az,p,q,r,V,alpha,beta\n"
    flights = [
        read_csv(file_with(tmp_path, head + "\n".join(f"{row}{',1' * 8}" for row in each) + "\n"))
        for each in (rows, wrong)
    ]
    assert flights[1].rejected == {"duplicate stamp": 1, "out of order": 1}
    np.testing.assert_array_equal(flights[1].time, flights[0].time)
    np.testing.assert_array_equal(flights[1]["ax"], flights[0]["ax"])


@pytest.mark.parametrize(
    ("column", "called"), [("alpha", "Alpha"), ("alpha", "aoa"), ("V", "TAS"), ("beta", "sideslip"), ("de", "Elevator")]
)
def test_a_column_by_another_name_is_asked_for(tmp_path, column, called):
    names = ["t", *(called if name == column else name for name in COLUMNS)]
    rows = "\n".join(",".join([str(k), *["1"] * len(COLUMNS)]) for k in range(3))
    with pytest.warns(InputWarning, match=f"no column '{column}', but '{called}'"):
        read_csv(file_with(tmp_path, f"{','.join(names)}\n{rows}\n"))


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
