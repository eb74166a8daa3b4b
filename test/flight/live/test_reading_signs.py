"""Readings of the wrong sign or unit are named. Truth: a body that moves by the kinematics, and flights."""

import math
import warnings

import numpy as np
import pytest
from harness import ROOT
from moving_body import NAMES, readings

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.csv import read_csv
from sysid_node.flight.live.reading_signs import Contradictions, ReadingSignsInFlight, checked_signs
from sysid_node.flight.logs.opening import load_flight_record
from sysid_node.flight.record import FlightRecord


def flown(factors: dict[str, float] | None = None) -> FlightRecord:
    """The moving body's flight, its readings multiplied by factors."""
    time, columns = readings()
    return FlightRecord(time, {name: (factors or {}).get(name, 1.0) * columns[name] for name in NAMES}, "made")


SENSORS = [*[0.3] * 3, *[0.02] * 3, 0.3, 0.01, 0.01]  # noise of forces m/s^2, rates rad/s, airspeed m/s, angles rad
WRONG = [
    ({"p": -1.0}, "p: the sign is wrong"),
    ({"q": -1.0}, "q: the sign is wrong"),
    ({"r": -1.0}, r"r( or ay)?: the sign is wrong"),
    ({"q": -1.0, "r": -1.0}, "q, r: the sign is wrong by the other readings; axes are forward, left, up where"),
    ({"p": -1.0, "q": -1.0, "r": -1.0}, "p, q, r: the sign"),
    ({"q": -1.0, "phi": math.nan, "theta": math.nan}, "q or az: the sign"),
    ({"alpha": -1.0}, "angle of attack: the sign is wrong .* positive with air from below"),
    ({"beta": -1.0}, "sideslip: the sign is wrong .* positive with air from the right"),
    ({"V": 1.944}, r"true_airspeed: about 1\.9 times .* in m/s and rad/s\?"),
    ({"V": 3.6}, r"true_airspeed: about 3\.[4-8] times"),
    ({"V": 1.944, "phi": math.nan, "theta": math.nan}, r"true_airspeed or q: about"),
    ({"V": 1 / 3.6}, r"true_airspeed: about 0\.28 times"),
    ({"p": 57.3, "q": 57.3, "r": 57.3}, "p, q, r: about 57, 57, 57 times what the attitude turns; in rad/s"),
    ({"q": 2.0}, r"q: about (1\.9|2) times what the attitude turns"),
]


def test_a_sound_flight_is_taken_without_a_word() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        record = flown()
        assert checked_signs(record) is record
        checked_signs(flown({"phi": math.nan, "theta": math.nan, "psi": math.nan}))
        checked_signs(flown({"alpha": math.nan, "beta": math.nan}))
        checked_signs(flown({"V": 1.3}))  # an error for the diagnosis, not a unit
        checked_signs(flown({"alpha": 2.0, "beta": 0.5}))


@pytest.mark.parametrize(("factors", "said"), WRONG)
def test_a_wrong_reading_is_named(factors: dict[str, float], said: str) -> None:
    with pytest.raises(InputError, match=f"made: {said}"):
        checked_signs(flown(factors))


@pytest.mark.parametrize("late", [-0.5, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3, 0.4, 0.5])
def test_air_data_that_come_late_or_early_are_not_of_the_wrong_sign(late: float) -> None:
    """Half a period late, an oscillation is reversed."""
    record = flown()
    columns = {name: np.interp(record.time - late, record.time, record[name]) for name in ("V", "alpha", "beta")}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_signs(FlightRecord(record.time, {**record.columns, **columns}, "late"))


def changed(flight: FlightRecord, **columns: np.ndarray) -> FlightRecord:
    return FlightRecord(flight.time, {**flight.columns, **columns}, "changed")


@pytest.mark.parametrize(
    ("bag", "late"), [("cdrw_multistep", 0.5), ("cdrw_near_stall", 0.3), ("cdrw_near_stall", -0.3)]
)
def test_bundled_flights_with_air_data_late_or_early_are_taken(bag: str, late: float) -> None:
    """Without a look at other times, the first shows a reversed sideslip and the others an airspeed in another unit."""
    flight = load_flight_record(ROOT / "bags" / bag, load_aircraft(bag[:4]))
    shifted = {name: np.interp(flight.time - late, flight.time, flight[name]) for name in ("V", "alpha", "beta")}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_signs(changed(flight, **shifted))


def test_accelerations_in_g_are_not_taken_for_an_airspeed_in_another_unit() -> None:
    flight = load_flight_record(ROOT / "bags" / "cdrw_near_stall", load_aircraft("cdrw"))
    in_g = changed(flight, **{name: flight[name] / 9.80665 for name in ("ax", "ay", "az")})
    with pytest.raises(InputError, match=r"mean specific force along z .* it is in g \(multiply by 9\.80665\)"):
        checked_signs(in_g)


def test_an_angle_of_attack_that_the_lift_contradicts_too_is_told_sooner() -> None:
    """In gusts the kinematics alone leave it open."""
    flight = load_flight_record(ROOT / "bags" / "cdfp_random", load_aircraft("cdfp"))
    reversed_alpha = changed(flight, alpha=-flight["alpha"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_signs(reversed_alpha)
        checked_signs(flight, opposite_alpha=True)
    with pytest.raises(InputError, match="angle of attack: the sign is wrong by rates and accelerations"):
        checked_signs(reversed_alpha, opposite_alpha=True)


def test_a_reversed_attitude_of_a_bundled_flight_is_a_warning_alone() -> None:
    flight = load_flight_record(ROOT / "bags" / "cdrw_multistep", load_aircraft("cdrw"))
    with pytest.warns(InputWarning, match="phi, theta, psi of the attitude: the sign is wrong"):
        checked_signs(changed(flight, **{name: -flight[name] for name in ("phi", "theta", "psi")}))


def test_a_weak_correlation_shows_no_sign_however_long_the_flight() -> None:
    """As of gusts that the aircraft answers: a fifth of the sideslip is reversed, the rest is noise."""
    time, columns = readings(600.0)
    noise = np.random.default_rng(2).normal(0.0, 0.05, time.size)
    record = FlightRecord(time, {**columns, "beta": noise - 0.2 * columns["beta"]}, "long")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_signs(record)


def test_an_attitude_that_stands_still_is_none() -> None:
    """As of a driver that leaves the orientation as it is."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_signs(flown({"phi": 0.0, "theta": 0.0, "psi": 0.0}))
    with pytest.raises(InputError, match="q or az: the sign"):
        checked_signs(flown({"phi": 0.0, "theta": 0.0, "psi": 0.0, "q": -1.0}))


@pytest.mark.parametrize(
    ("factors", "said"),
    [
        ({"phi": -1.0}, "phi"),
        ({"theta": -1.0}, "theta"),
        ({"theta": -1.0, "psi": -1.0}, "theta, psi"),
        ({"phi": -1.0, "theta": -1.0, "psi": -1.0}, r"phi, theta(, psi)?"),
    ],
)
def test_an_attitude_of_the_wrong_sign_is_a_warning_alone(factors: dict[str, float], said: str) -> None:
    """No derivative is estimated from it."""
    with pytest.warns(InputWarning, match=f"made: {said} of the attitude: the sign is wrong"):
        checked_signs(flown(factors))


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_in_flight_the_same_is_found_within_a_minute(noise: float) -> None:
    for factors, said in [({}, ""), ({"r": -1.0}, "r or ay: "), ({"beta": -1.0}, "sideslip: ")]:
        time, columns = readings(40.0, rate=50.0)
        rows = np.column_stack([factors.get(name, 1.0) * columns[name] for name in NAMES])
        rows[:, :9] += noise * np.random.default_rng(1).normal(
            0.0, [0.3] * 3 + [0.02] * 3 + [0.3, 0.01, 0.01], (time.size, 9)
        )
        signs = ReadingSignsInFlight()
        for stamp, (moment, row) in enumerate(zip(time.tolist(), rows.tolist(), strict=True)):
            signs.hear(stamp, (row[9], row[10]))
            if signs.wants(moment):
                signs.add(moment, stamp, row[:9])
        assert signs.found.fault.startswith(said)
        assert bool(signs.found.fault) is bool(said)
        assert not signs.found.doubt


def test_in_flight_the_lift_helps_to_tell_the_angle_of_attack() -> None:
    flight = load_flight_record(ROOT / "bags" / "cdfp_random", load_aircraft("cdfp"))
    names = ("ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta")
    rows = np.column_stack([-flight[name] if name == "alpha" else flight[name] for name in names])
    found = {}
    for opposite in (False, True):
        signs = ReadingSignsInFlight()
        for moment, row in zip(flight.time.tolist(), rows.tolist(), strict=True):
            if signs.wants(moment):
                signs.add(moment, 0, row, opposite_alpha=opposite)
        found[opposite] = signs.found.fault
    assert found[False] == ""
    assert found[True].startswith("angle of attack: the sign is wrong")


def test_in_flight_an_attitude_that_never_comes_is_none() -> None:
    time, columns = readings(40.0, rate=50.0)
    rows = np.column_stack([columns[name] for name in NAMES])
    signs = ReadingSignsInFlight()
    for moment, row in zip(time.tolist(), rows.tolist(), strict=True):
        if signs.wants(moment):
            signs.add(moment, 0, row[:9])
    assert signs.found == Contradictions()


@pytest.mark.parametrize("bag", ["cdrw_turbulence", "cdfp_random", "cdrw_near_stall", "cdrw_failed_elevator"])
def test_rates_in_other_axes_are_seen_in_gusts_near_the_stall_and_beside_a_failure(bag: str) -> None:
    flight = load_flight_record(ROOT / "bags" / bag, load_aircraft(bag[:4]))
    columns = {**flight.columns, "q": -flight["q"], "r": -flight["r"]}
    with pytest.raises(InputError, match="q, r: the sign is wrong"):
        checked_signs(FlightRecord(flight.time, columns, "turned"))


def test_real_flights_are_sound_and_reversed_ones_are_not(flights) -> None:
    """All but the Twin Otter's, which lasts 8 s."""
    paths = [path for path in sorted(flights.glob("*.csv")) if not path.stem.startswith("twin_otter")]
    assert len(paths) >= 7
    for path in paths:
        flight = read_csv(path)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            checked_signs(flight)
        with pytest.raises(InputError, match=r"q( or az)?: the sign is wrong"):
            checked_signs(FlightRecord(flight.time, {**flight.columns, "q": -flight["q"]}, path.stem))
