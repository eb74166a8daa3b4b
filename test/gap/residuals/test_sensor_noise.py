"""Noise added to a flight once more; truth: the aircraft file's standard deviations and the topics' rates."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.residuals.sensor_noise import with_added_noise


def added(aircraft, flight, name: str) -> np.ndarray:
    """What is added to a column, of 20 realisations."""
    random = np.random.default_rng(2)
    noisy = (with_added_noise(aircraft, flight, random) for _ in range(20))
    return np.concatenate([one.record[name] - flight.record[name] for one in noisy])


@pytest.mark.parametrize(("name", "sensor"), [("az", "accel"), ("q", "gyro"), ("alpha", "alpha"), ("V", "airspeed")])
def test_its_spread_is_the_files(aircraft, plain, name: str, sensor: str) -> None:
    """Of 50 000 samples the standard deviation is known to 0.3 %."""
    assert added(aircraft, plain, name).std() == pytest.approx(aircraft.noise[sensor], rel=0.02)


def test_air_data_sampled_at_a_quarter_of_the_rate_have_four_times_the_power_in_the_band(aircraft, plain) -> None:
    slow = replace(plain, air_rate=0.25 * plain.air_rate)
    ratio = added(aircraft, slow, "alpha").var() / added(aircraft, plain, "alpha").var()
    assert ratio == pytest.approx(4.0, rel=0.05)


def test_columns_that_were_filled_with_zeros_stay_as_they_are(aircraft, plain) -> None:
    filled = replace(plain, filled=("beta",))
    assert not added(aircraft, filled, "beta").any()


@pytest.mark.parametrize("command_interval", [0.0, 0.1])
def test_commands_move_in_time_by_less_than_a_sample(aircraft, plain, command_interval: float) -> None:
    """Truth: a ramp, whose change is its slope times the shift, uniform within half a period of a topic or a log."""
    ramp = plain.record.time.copy()
    record = replace(plain.record, columns={**plain.record.columns, "de": ramp})
    period = command_interval or 1.0 / plain.actuator_rate
    shift = added(aircraft, replace(plain, record=record, command_interval=command_interval), "de")
    inner = shift.reshape(20, -1)[:, 5:-5]
    assert np.abs(inner).max() <= 0.5 * period + 1e-12
    # the shift goes in a line from one time of a message to the next, so that a slow log's is two thirds of uniform
    between = 2.0 / 3.0 if command_interval else 1.0
    assert inner.var() == pytest.approx(between * period**2 / 12.0, rel=0.1)
