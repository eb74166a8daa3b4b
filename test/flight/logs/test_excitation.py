"""How well an axis was excited: a measure without size, whose errors are those of repeated flights."""

import numpy as np
import pytest

from sysid_node.flight.logs.autopilot_log import LoggedCommands, Signal
from sysid_node.flight.logs.checks.excitation import excitation

LP, LDA = -8.0, 30.0  # 1/s and 1/s^2 per rad, of an aircraft of two metres' span
GUST, CORRELATION = 0.5, 0.3  # rad/s^2 and s: rolling moments of gusts


def rolled(
    seed: int, *, size: float = 1.0, amplitude: float = 0.05, seconds: float = 30.0, gusts: float = GUST
) -> tuple[Signal, Signal]:
    """A rolling flight with aileron 2-1-1 pulses in gusts, of an aircraft ``size`` times as large.

    By Froude's law times grow with the square root of the size, and angles stay. The aileron is that of a pilot: all
    pulses within the first third.
    """
    clock = np.sqrt(size)
    step = 0.01
    time = np.arange(0.0, seconds, step)
    rng = np.random.default_rng(seed)
    pulses = np.select([time < 2, time < 4, time < 5, time < 6, time < 10], [0.0, 1.0, -1.0, 1.0, 0.0], 0.0)
    aileron = amplitude * (pulses + 0.02 * rng.standard_normal(time.size))
    gust = np.zeros(time.size)
    kick = gusts * np.sqrt(1.0 - np.exp(-2.0 * step / CORRELATION)) * rng.standard_normal(time.size)
    for i in range(1, time.size):
        gust[i] = gust[i - 1] * np.exp(-step / CORRELATION) + kick[i]
    p = np.zeros(time.size)
    for i in range(1, time.size):
        p[i] = p[i - 1] + step * (LP * p[i - 1] + LDA * aileron[i - 1] + gust[i - 1])
    imu = np.zeros((time.size, 6))
    imu[:, 2], imu[:, 3] = -9.81, (p + 0.002 * rng.standard_normal(time.size)) / clock
    stamps = np.round(time * clock * 1e9).astype(np.int64) + 10**9
    return Signal("imu", stamps, imu), Signal("servos", stamps, aileron[:, np.newaxis])


def judged(signals, names=("aileron",)):
    imu, inputs = signals
    return excitation(imu, LoggedCommands(names, inputs))


def test_the_error_is_that_of_repeated_flights():
    """Truth: Monte Carlo, and the response in air without gusts.

    The size of the response is scattered over 60 flights by its error, of which a part changes its shape alone. The
    scatter of 60 has itself a standard error of 9 %.
    """
    found = [judged(rolled(seed))["roll"] for seed in range(60)]
    responses = np.array([one.response for one in found])
    scatter = np.std(responses) / np.mean(responses)
    assert 0.9 < np.median([one.error for one in found]) / scatter < 1.5
    assert np.mean(responses) == pytest.approx(judged(rolled(0, gusts=0.0))["roll"].rate, rel=0.05)


@pytest.mark.parametrize("size", [4.0, 10.0])
def test_the_measure_has_no_size(size):
    """The same manoeuvre of a larger aircraft turns it more slowly, and is as good."""
    small, large = judged(rolled(1))["roll"], judged(rolled(1, size=size))["roll"]
    assert large.rate == pytest.approx(small.rate / np.sqrt(size), rel=1e-6)
    assert large.word == small.word == "well"
    assert large.error == pytest.approx(small.error, rel=0.35)


def test_a_larger_input_in_the_same_gusts_is_better():
    words = [judged(rolled(2, amplitude=amplitude))["roll"].word for amplitude in (0.001, 0.03, 0.1)]
    assert words == ["hardly", "weakly", "well"]


def test_a_manoeuvre_is_as_good_in_a_long_log_as_in_a_short_one():
    """The rate's root mean square falls with the time flown straight, which takes nothing from the manoeuvre."""
    short, long = judged(rolled(3))["roll"], judged(rolled(3, seconds=120.0))["roll"]
    assert long.rate < 0.9 * short.rate
    assert long.error == pytest.approx(short.error, rel=0.4)


def test_gusts_alone_excite_nothing():
    imu, inputs = rolled(4, amplitude=0.0)
    noise = np.random.default_rng(5).standard_normal((len(inputs), 1))
    found = judged((imu, Signal("servos", inputs.stamp_ns, 0.001 * noise)))["roll"]
    assert found.rate > np.radians(2.0)
    assert found.word == "hardly"


def test_a_control_that_stood_still_shows_nothing():
    imu, inputs = rolled(6, amplitude=0.1)
    still = np.column_stack([inputs.values, np.zeros((len(inputs), 2))])
    found = judged((imu, Signal("servos", inputs.stamp_ns, still)), ("aileron", "elevator", "rudder"))
    assert (found["pitch"].word, found["pitch"].control, found["pitch"].error) == ("hardly", "elevator", np.inf)
    assert found["roll"].word == "well"


def test_of_outputs_without_names_the_one_that_acts_is_found():
    imu, inputs = rolled(7, amplitude=0.1)
    other = np.sin(0.7 * np.arange(len(inputs)) * 0.01)[:, np.newaxis]
    pulses = 1500.0 + 400.0 * np.hstack([other, inputs.values, 0.5 * other])
    found = judged((imu, Signal("rc/out", inputs.stamp_ns, pulses)), ("out1", "out2", "throttle"))
    assert found["roll"].control == "out2"
    assert found["roll"].word == "well"


def test_gaps_and_unmeasured_samples_are_left_out():
    """A pause of the log between two manoeuvres, over which nothing may be connected, and an IMU that was invalid."""
    imu, inputs = rolled(8)
    whole = judged((imu, inputs))["roll"]
    imu.values[200:220, 3] = np.nan
    keep = (imu.stamp_ns < 11 * 10**9) | (imu.stamp_ns > 15 * 10**9)
    cut = judged(tuple(signal.selected(keep) for signal in (imu, inputs)))["roll"]
    assert cut.error == pytest.approx(whole.error, rel=0.3)


@pytest.mark.parametrize("value", [np.inf, -1e300, 1e300])
def test_impossible_values_are_left_out(value):
    imu, inputs = rolled(10)
    whole = judged((imu, inputs))["roll"]
    imu.values[::97] = value
    inputs.values[::89] = value
    found = judged((imu, inputs))["roll"]
    assert found.rate == pytest.approx(whole.rate, rel=0.05)
    assert found.error == pytest.approx(whole.error, rel=0.5)


@pytest.mark.parametrize("count", [0, 1, 30])
def test_too_short_a_flight_tells_nothing(count):
    signals = tuple(signal.selected(np.arange(len(signal)) < count) for signal in rolled(9))
    assert judged(signals)["roll"].word == "hardly"


@pytest.mark.parametrize("pause", [60.0, 1.0e9])
def test_a_pause_does_not_count(pause):
    """Truth: the flight without it. A clock that was set ahead by years must not ask for as many steps."""
    imu, inputs = rolled(3)
    whole = judged((imu, inputs))["roll"]
    later = np.where(imu.stamp_ns > imu.stamp_ns[0] + 15_000_000_000, round(pause * 1e9), 0)
    moved = [Signal(one.source, one.stamp_ns + later, one.values) for one in (imu, inputs)]
    found = judged(moved)["roll"]
    assert found.response == pytest.approx(whole.response, rel=0.05)
    assert found.error == pytest.approx(whole.error, rel=0.1)


def test_a_pause_of_one_signal_is_one_of_both():
    """Truth: the flight whose signals pause together; the inputs are logged on, for an hour."""
    imu, inputs = rolled(3)
    hour = 3_600_000_000_000
    later = np.where(imu.stamp_ns > imu.stamp_ns[0] + 15_000_000_000, hour, 0)
    moved = [Signal(one.source, one.stamp_ns + later, one.values) for one in (imu, inputs)]
    between = imu.stamp_ns[0] + np.arange(15_100_000_000, hour, 100_000_000)
    stamps = np.concatenate([moved[1].stamp_ns, between])
    order = np.argsort(stamps)
    values = np.concatenate([moved[1].values, np.zeros((between.size, 1))])
    logged_on = Signal("servos", stamps[order], values[order])
    assert judged((moved[0], logged_on))["roll"].error == pytest.approx(judged(moved)["roll"].error, rel=0.05)
