"""Flights as columns that would be believed: wrong units, misspelt and missing columns, files without end."""

import os
import threading
import warnings

import numpy as np
import pytest

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.csv import LINE_LIMIT, read_csv, write_csv
from sysid_node.flight.record import FlightRecord

DEGREES = np.degrees(1.0)


def flown(seconds=20.0, rate=50.0) -> FlightRecord:
    """A flight whose attitude is the integral of its rates, small throughout."""
    t = np.arange(int(seconds * rate)) / rate
    theta, phi, psi = 0.05 + 0.04 * np.sin(1.5 * t), 0.1 * np.sin(0.9 * t), 0.3 * np.sin(0.4 * t)
    columns = {
        "ax": 0.5 + 0.1 * np.sin(t), "ay": 0.1 * np.cos(t), "az": -9.8 + 0.3 * np.sin(2 * t),
        "p": np.gradient(phi, t), "q": np.gradient(theta, t), "r": np.gradient(psi, t),
        "phi": phi, "theta": theta, "psi": psi,
        "V": 18.0 + np.sin(0.3 * t), "alpha": 0.05 + 0.04 * np.sin(1.5 * t), "beta": 0.04 * np.sin(2 * t),
        "rho": np.full(t.size, 1.2), "thrust": np.full(t.size, 5.0),
        "de": 0.05 * np.sin(2 * t), "da": 0.05 * np.sin(3 * t), "dr": 0.05 * np.cos(3 * t),
    }  # fmt: skip
    return FlightRecord(t, columns)


def written(tmp_path, flight=None, **changed):
    """The path of a flight as CSV, some of its columns changed; None leaves one out."""
    flight = flight or flown()
    columns = {name: values for name, values in {**flight.columns, **changed}.items() if values is not None}
    write_csv(tmp_path / "log.csv", FlightRecord(flight.time, columns))
    return tmp_path / "log.csv"


def test_a_sound_flight_is_taken_as_it_is_without_a_word(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = read_csv(written(tmp_path))
    assert read.rejected == {}
    np.testing.assert_array_equal(read["q"], flown()["q"])


@pytest.mark.parametrize(
    ("name", "factor", "said"),
    [
        ("alpha", DEGREES, r"angle_of_attack over pi/2 rad \(degrees\?\)"),
        ("beta", DEGREES, r"sideslip over pi/2 rad \(degrees\?\)"),
        ("de", DEGREES, r"de over pi/2 rad \(degrees\?\)"),
        ("dr", DEGREES, r"dr over pi/2 rad \(degrees\?\)"),
        ("theta", DEGREES, r"theta over pi/2 rad \(degrees\?\)"),
        ("rho", 1e-3, r"air_density not within"),
        ("rho", 1.94e-3, r"air_density not within"),
        ("V", 100.0, r"true_airspeed not within"),
        ("az", 1000.0, "specific force over"),
        ("q", DEGREES, r"theta changes 57 times less than q says; is q in deg/s\?"),
        ("p", DEGREES, r"phi changes 57 times less than p says; is p in deg/s\?"),
        ("psi", DEGREES, r"psi changes 57 times as much as r says; is psi in degrees\?"),
    ],
)
def test_a_wrong_unit_is_said_with_the_column(tmp_path, name, factor, said):
    """All angles of this flight are below 0.3 rad and all rates below 8 deg/s: no single value shows the unit."""
    with pytest.raises(InputError, match=said) as caught:
        read_csv(written(tmp_path, **{name: flown()[name] * factor}))
    assert "log.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_attitude_in_degrees_within_the_limits_shows_beside_the_rates(tmp_path):
    small = flown()["theta"] / 40.0
    with pytest.raises(InputError, match=r"theta changes 57 times as much as q says; is theta in degrees\?"):
        read_csv(written(tmp_path, theta=small * DEGREES, q=flown()["q"] / 40.0))


def test_a_heading_that_passes_north_is_no_wrong_unit(tmp_path):
    psi = np.mod(flown()["psi"] + 6.2, 2.0 * np.pi)
    assert read_csv(written(tmp_path, psi=psi)).rejected == {}


def test_single_wrong_samples_are_left_out_and_counted_as_messages_are(tmp_path):
    flight = flown()
    alpha, az = flight["alpha"].copy(), flight["az"].copy()
    alpha[[3, 7]], az[500] = 40.0, 1e300
    read = read_csv(written(tmp_path, alpha=alpha, az=az))
    assert read.rejected == {"angle_of_attack over pi/2 rad (degrees?)": 2, "specific force over 300 m/s^2": 1}
    assert len(read) == len(flight) - 3
    assert np.abs(read["alpha"]).max() < 0.1


def test_time_on_the_ground_is_left_out(tmp_path):
    speed = np.where(flown().time < 5.0, 0.0, flown()["V"])
    assert len(read_csv(written(tmp_path, V=speed))) == 750


@pytest.mark.parametrize(("factor", "said"), [(1e9, "ns"), (1e6, "us"), (1e3, "ms"), (1e-6, "expected seconds")])
def test_time_in_another_unit(tmp_path, factor, said):
    flight = flown()
    with pytest.raises(InputError, match=f"time steps by .*{said}"):
        read_csv(written(tmp_path, FlightRecord(flight.time * factor, flight.columns)))


@pytest.mark.parametrize(
    ("column", "misspelt"), [("alpha", "aplha"), ("alpha", "Alpha"), ("thrust", "trust"), ("V", "v"), ("theta", "thta")]
)
def test_a_misspelt_column_is_named_with_the_likely_one(tmp_path, column, misspelt):
    with pytest.warns(InputWarning, match=f"log.csv: no column '{column}', but '{misspelt}'.*is it '{column}'"):
        read_csv(written(tmp_path, **{column: None, misspelt: flown()[column]}))


def test_a_dropped_column_is_named(tmp_path):
    with pytest.warns(InputWarning, match="no column 'alpha', 'beta': taken as not measured"):
        read_csv(written(tmp_path, alpha=None, beta=None))


def test_a_column_that_nothing_uses_is_named_where_the_aircraft_is_known(tmp_path):
    zeros = np.zeros(len(flown()))
    path = written(tmp_path, df=zeros, battery=zeros, dr=None, rudder=zeros)
    with pytest.warns(InputWarning) as said:
        read_csv(path, ("de", "da", "df"))
    misspelt, unused = [str(one.message) for one in said]  # the flap is a control, and the rudder is not named twice
    assert "no column 'dr', but 'rudder', which is not used; is it 'dr'?" in misspelt
    assert "not used: column 'battery'; rename it" in unused
    path = written(tmp_path, **{f"cell_{n}": zeros for n in range(6)})
    with pytest.warns(InputWarning, match="'cell_3' and 2 more; rename it"):
        read_csv(path, ("de", "da", "dr"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_csv(path)  # any column may be a control


def test_two_flights_in_one_file_are_refused(tmp_path):
    """A clock that was set from 1970 to 2026 within the flight looks the same."""
    flight = flown()
    time = np.where(flight.time < 5.0, flight.time, flight.time + 1.7e9)
    with pytest.raises(InputError, match=r"time jumps by 1.7e\+09 s at 4.98 s"):
        read_csv(written(tmp_path, FlightRecord(time, flight.columns)))


def test_a_flight_without_a_value_is_refused(tmp_path):
    nothing = {name: np.full(1000, np.nan) for name in flown().columns}
    with pytest.raises(InputError, match="no values in any column"):
        read_csv(written(tmp_path, FlightRecord(flown().time, nothing)))


def test_semicolons_and_tabs(tmp_path):
    for mark in ";\t":
        (tmp_path / "log.csv").write_text(mark.join(["t", "ax"]) + "\n" + mark.join(["0", "1"]) + "\n")
        with pytest.raises(InputError, match="not separated by commas"):
            read_csv(tmp_path / "log.csv")


def test_a_hundred_thousand_columns(tmp_path):
    (tmp_path / "log.csv").write_text("t," + ",".join(f"c{i}" for i in range(10_000)) + "\n")
    with pytest.raises(InputError, match="10001 columns, over 1000"):
        read_csv(tmp_path / "log.csv")


def test_a_line_that_never_ends(tmp_path):
    (tmp_path / "log.csv").write_text("t,ax\n" + "0" * (2 * LINE_LIMIT))
    with pytest.raises(InputError, match=r"line 2 is longer than|field larger than"):
        read_csv(tmp_path / "log.csv")


def test_a_file_that_never_ends(tmp_path):
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="device or pipe"):
        read_csv(tmp_path / "zero.csv")


def test_a_pipe_that_never_ends(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    writer = threading.Thread(target=lambda: os.close(os.open(tmp_path / "pipe.csv", os.O_WRONLY)))
    writer.start()
    with pytest.raises(InputError, match="device or pipe"):
        read_csv(tmp_path / "pipe.csv")
    writer.join()
