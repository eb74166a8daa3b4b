"""Flights made ready; truth: sines, whose derivatives and amplitudes are known, and what was taken away."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gap_flights import whole

from sysid_node import load
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.csv import write_csv
from sysid_node.flight.logs.fractions import between_commands
from sysid_node.flight.record import FlightRecord
from sysid_node.gap.flightdata.gap_flight import (
    ANALYSIS_RATE,
    GapFlight,
    completed_flights,
    flights_of_streams,
    load_gap_flights,
    resampled,
)
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import fly_sortie
from sysid_node.sim.prediction.signals import unfiltered_columns

ROOT = Path(__file__).resolve().parents[3]
RATE, DURATION = 200.0, 20.0
NAMES = ("ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta", "rho", "phi", "theta", "psi", "thrust")


def flight_with(aircraft: Aircraft, **columns: np.ndarray) -> GapFlight:
    """A flight at 200 Hz of constant signals but those given."""
    time = np.arange(round(DURATION * RATE) + 1) / RATE
    constant = {name: np.full(time.size, 0.1) for name in (*NAMES, *aircraft.control_symbols)}
    return GapFlight(FlightRecord(time, {**constant, **columns}), RATE, RATE, RATE, source="made by hand")


def without(flight: GapFlight, *names: str) -> GapFlight:
    columns = {**flight.record.columns, **{name: np.full(len(flight.record), np.nan) for name in names}}
    return replace(flight, record=replace(flight.record, columns=columns))


@pytest.fixture
def time() -> np.ndarray:
    return np.arange(round(DURATION * RATE) + 1) / RATE


def test_angular_accelerations_are_the_derivatives_of_the_rates(aircraft, time) -> None:
    omega = 2.0 * np.pi * 2.0
    record = resampled(flight_with(aircraft, q=np.sin(omega * time)))
    inner = slice(25, -25)
    expected = gain(2.0) * omega * np.cos(omega * record.time)
    np.testing.assert_allclose(record["q_rate"][inner], expected[inner], atol=2e-3 * omega)


def gain(frequency: float) -> float:
    """Of the Gaussian low-pass, 1 / sqrt(2) at 11 Hz."""
    return float(2.0 ** (-0.5 * (frequency / 11.0) ** 2))


@pytest.mark.parametrize("frequency", [0.5, 4.0, 20.0])
def test_a_sine_passes_the_low_pass_without_delay_and_with_the_gain_of_a_gaussian(
    aircraft, time, frequency: float
) -> None:
    sine = np.sin(2.0 * np.pi * frequency * time)
    record = resampled(flight_with(aircraft, q=sine))
    inner = slice(25, -25)
    expected = gain(frequency) * np.sin(2.0 * np.pi * frequency * record.time)
    np.testing.assert_allclose(record["q"][inner], expected[inner], atol=1e-3)


def test_what_the_analysis_rate_folds_into_the_band_is_taken_out(aircraft, time) -> None:
    record = resampled(flight_with(aircraft, q=np.sin(2.0 * np.pi * 47.0 * time)))
    assert np.abs(record["q"][25:-25]).max() < 2.0 * gain(47.0) < 0.004


def test_a_step_does_not_overshoot(aircraft, time) -> None:
    """A free play would hold the surface where an overshoot has taken it."""
    record = resampled(flight_with(aircraft, de=np.where(time > 5.0, 0.1, 0.0)))
    assert record["de"].min() > -1e-9 and record["de"].max() < 0.1 + 1e-9


def test_commands_are_also_kept_as_they_were_recorded(aircraft, time) -> None:
    record = resampled(flight_with(aircraft, de=np.where(time > 5.005, 0.1, 0.0)))
    kept = np.column_stack([record[name] for name in unfiltered_columns("de")]).ravel()  # 200 Hz
    np.testing.assert_array_equal(kept, np.where(np.arange(kept.size) / 200.0 > 5.005, 0.1, 0.0))


def test_the_time_base_is_regular(aircraft) -> None:
    record = resampled(flight_with(aircraft))
    np.testing.assert_allclose(np.diff(record.time), 1.0 / ANALYSIS_RATE)
    assert record.duration == pytest.approx(DURATION, abs=1.0 / ANALYSIS_RATE)


def test_a_heading_through_south_is_not_smeared(plain) -> None:
    """A turn of a full circle in the record's range of half turns, against the same without the jump."""
    heading = np.linspace(2.0, 2.0 + 2.0 * np.pi, len(plain.record))
    turned = (resampled(replace(plain, record=replace(plain.record, columns={**plain.record.columns, "psi": psi})))
              for psi in (heading, (heading + np.pi) % (2.0 * np.pi) - np.pi))  # fmt: skip
    whole, jumping = (record["psi"] for record in turned)
    np.testing.assert_allclose(jumping, whole, atol=1e-9)


def interrupted(aircraft: Aircraft, time: np.ndarray, pauses: dict[float, float], moved: np.ndarray) -> GapFlight:
    """A flight whose recording pauses at these times for so many s; ``moved`` (N,) is its elevator, rad."""
    later = time + sum(seconds * (time > at) for at, seconds in pauses.items())
    flight = flight_with(aircraft, de=moved)
    return replace(flight, record=replace(flight.record, time=later))


def test_the_parts_between_interruptions_are_flights(aircraft, time) -> None:
    elevator = 0.1 * np.sin(time)
    with pytest.warns(InputWarning, match=r"once for more than 0\.2 s; .* on its 2 parts, 20 of 23 s"):
        first, second = completed_flights(aircraft, interrupted(aircraft, time, {8.0: 3.0}, elevator))
    assert (first.record.duration, second.record.duration) == pytest.approx((8.0, 12.0), abs=2.0 / RATE)
    assert first.record.time[0] == second.record.time[0] == 0.0
    assert (first.begin, second.begin) == pytest.approx((0.0, 11.0), abs=2.0 / RATE)
    assert (second.record.start_ns - first.record.start_ns) * 1e-9 == pytest.approx(second.begin)
    np.testing.assert_array_equal(np.concatenate([first.record["de"], second.record["de"]]), elevator)


@pytest.mark.parametrize("seconds", [0.25, 0.45])
def test_nothing_is_interpolated_across_an_interruption(aircraft, time, seconds: float) -> None:
    with pytest.warns(InputWarning, match="interrupted once"):
        parts = completed_flights(aircraft, interrupted(aircraft, time, {6.5: seconds}, 0.1 * np.sin(time)))
    assert [part.record.duration for part in parts] == pytest.approx([6.5, DURATION - 6.5], abs=2.0 / RATE)


def test_short_parts_and_those_without_a_moving_surface_are_left_out(aircraft, time) -> None:
    """The first part is short, in the second no surface moves."""
    flight = interrupted(aircraft, time, {4.0: 1.0, 12.0: 1.0}, 0.1 * np.sin(time) * (time > 12.0))
    with pytest.warns(InputWarning, match=r"one part \(the others are shorter than 6 s, or .*\), 7\.99 of 22 s"):
        [kept] = completed_flights(aircraft, flight)
    assert kept.begin == pytest.approx(14.0, abs=2.0 / RATE)


def test_where_no_part_can_be_used_the_longest_says_why(aircraft, time) -> None:
    pauses = {4.0: 1.0, 9.0: 1.0, 14.5: 1.0}
    flight = interrupted(aircraft, time, pauses, 0.1 * np.sin(time))
    with pytest.warns(InputWarning), pytest.raises(InputError, match=r"5\.5 s of flight without interruption"):
        completed_flights(aircraft, flight)


def test_a_few_missing_samples_are_bridged_within_the_noise(aircraft, time) -> None:
    """Truth: a constant rate. A spline would continue the slope that the noise of two samples makes."""
    noisy = 0.01 * np.random.default_rng(3).normal(size=time.size)
    complete = flight_with(aircraft, q=noisy)
    kept = ~((time > 5.0) & (time < 5.15))
    columns = {name: values[kept] for name, values in complete.record.columns.items()}
    holed = replace(complete, record=replace(complete.record, time=time[kept], columns=columns))
    assert whole(aircraft, holed).record.duration == pytest.approx(complete.record.duration)
    assert np.abs(resampled(holed)["q"]).max() < 0.03


@pytest.mark.parametrize("name", ["beta", "alpha", "thrust", "de"])
def test_samples_without_a_value_are_left_out(aircraft, time, name: str) -> None:
    """Truth: the same flight without these samples."""
    complete = flight_with(aircraft)
    lost = (time > 5.0) & (time < 5.1)
    columns = {**complete.record.columns, name: np.where(lost, np.nan, complete.record[name])}
    with pytest.warns(InputWarning, match=rf": 19 of 4001 samples lack a value of {name}, and are left out"):
        kept = whole(aircraft, replace(complete, record=replace(complete.record, columns=columns)))
    assert kept.lateral and not kept.inferred and not kept.filled
    np.testing.assert_array_equal(kept.record.time, time[~lost])
    np.testing.assert_array_equal(kept.record["q"], complete.record["q"][~lost])


def test_a_long_time_without_a_value_is_an_interruption(aircraft, time) -> None:
    complete = flight_with(aircraft, de=0.1 * np.sin(time))
    columns = {**complete.record.columns, "V": np.where((time > 7.0) & (time < 7.5), np.nan, complete.record["V"])}
    with pytest.warns(InputWarning) as said:
        parts = completed_flights(aircraft, replace(complete, record=replace(complete.record, columns=columns)))
    assert [str(one.message).split(";")[0].split(": ")[1] for one in said] == [
        "99 of 4001 samples lack a value of V, and are left out",
        "the recording is interrupted once for more than 0.2 s",
    ]
    assert [part.record.duration for part in parts] == pytest.approx([7.0, DURATION - 7.5], abs=2.0 / RATE)


def test_lateral_signals_that_were_not_measured_are_zero(aircraft) -> None:
    flight = whole(aircraft, without(flight_with(aircraft), "ay", "p", "r", "beta"))
    assert not flight.lateral and set(flight.filled) == {"ay", "p", "r", "beta"}
    assert not flight.record["ay"].any() and flight.record["q"].all()


@pytest.mark.parametrize("name", ["az", "V", "de"])
def test_a_signal_that_is_needed_is_named(aircraft, name: str) -> None:
    with pytest.raises(InputError, match=rf"no complete {name}"):
        whole(aircraft, without(flight_with(aircraft), name))


@pytest.mark.slow
@pytest.mark.parametrize("logged", [10, 100])
def test_a_slow_logs_commands_keep_their_interval_apart_from_the_rate_of_the_lines(aircraft, logged: int) -> None:
    """Truth: the log's own rate. A rate of messages is not that at which steps were logged."""
    simulator = Simulator(aircraft, 100.0)
    streams = FlightSampler(100.0, 100.0, logged).record(fly_sortie(simulator, np.zeros((1001, 4))))
    [flight] = flights_of_streams(replace(streams, actuators=between_commands(streams.actuators)), aircraft)
    assert flight.step_interval == pytest.approx(1.0 / logged, rel=0.02)
    assert flight.actuator_rate > 150.0


def test_a_flight_with_a_dead_sensor_is_refused(tmp_path) -> None:
    """Nothing of the diagnosis could tell it from an effect of the aircraft."""
    record = load(ROOT / "bags" / "cdrw_multistep", "cdrw").record
    for name, beta in (("sound", record["beta"]), ("dead", np.full(len(record), 0.01))):
        write_csv(tmp_path / f"{name}.csv", replace(record, columns={**record.columns, "beta": beta}))
    known = load_aircraft("cdrw")
    [sound] = load_gap_flights(tmp_path / "sound.csv", known, None, "flu")
    assert sound.lateral
    with pytest.raises(InputError, match="dead: sideslip: no change for 10 s: a dead sensor"):
        load_gap_flights(tmp_path / "dead.csv", known, None, "flu")


def test_a_flight_that_is_too_short_is_refused(aircraft, time) -> None:
    flight = flight_with(aircraft)
    columns = {name: values[time < 5.0] for name, values in flight.record.columns.items()}
    short = replace(flight, record=FlightRecord(time[time < 5.0], columns))
    with pytest.raises(InputError, match=r"5\.0 s of flight without interruption; the gap needs 6 s or more"):
        whole(aircraft, short)
