"""Commands through servos. Truth: the step response of a first-order lag, 1 - exp(-t / T), and the servos' moments."""

import math

import numpy as np
import pytest
from scipy import signal

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.model import blocks, lagged_controls
from sysid_node.faults.model.lagged_controls import LAGS, SHAPE, LaggedControls, shares_of
from sysid_node.faults.model.terms import design_of, terms
from sysid_node.online.types import SAMPLE_COLUMNS

AIRCRAFT, STEP = load_aircraft("cdrw"), 0.005


def test_each_lag_s_step_response() -> None:
    lagged = LaggedControls(2)
    lagged.follow(0.0, [0.0, 0.2])
    lagged.follow(1e-9, [0.1, 0.2])
    for k in range(1, 60):
        found = lagged.follow(k * STEP, [0.1, 0.2])
        assert found == pytest.approx([*(-0.1 * math.exp(-k * STEP / lag) for lag in LAGS), 0.0, 0.0], abs=1e-6)


def test_a_record_s_are_those_of_its_samples() -> None:
    random = np.random.default_rng(3)
    time, controls = np.cumsum(random.uniform(0.004, 0.02, 100)), random.normal(size=(100, 3))
    lagged = LaggedControls(3)
    live = [lagged.follow(t, row) for t, row in zip(time.tolist(), controls.tolist(), strict=True)]
    np.testing.assert_array_equal(lagged_controls.of_record(time, controls), live)


@pytest.mark.parametrize("late", [0.0, 0.01, *LAGS, 0.2])
def test_the_sum_has_the_moments_of_a_lag(late: float) -> None:
    """The impulse response of F_T has the moments T and 2 T^2."""
    shares, errors = shares_of(late, 0.002)
    assert shares @ LAGS == pytest.approx(late, abs=1e-12)
    assert shares @ np.square(LAGS) == pytest.approx(late**2, abs=1e-12)
    slopes = (shares_of(late + 1e-6, 0.0)[0] - shares) / 1e-6
    np.testing.assert_allclose(errors, np.hypot(0.002 * slopes, SHAPE * late / np.array(LAGS)), rtol=1e-3)


@pytest.mark.parametrize(
    "servo",
    [([1.0], [0.02, 1.0]), ([1.0], [0.2, 1.0]), *(([w * w], [1.0, 1.4 * w, w * w]) for w in (18.8, 31.4, 50.3))],
    ids=["20 ms", "200 ms", "3 Hz", "5 Hz", "8 Hz"],
)
def test_a_sum_of_them_is_nearly_any_servo(servo: tuple[list[float], list[float]]) -> None:
    """A 3-2-1-1, averaged over blocks of 0.1 s: a quarter of what it is behind by is left at most."""
    time, command = np.arange(0.0, 6.0, STEP), np.zeros(1200)
    for begin, end, sign in ((1.0, 2.05, 1.0), (2.05, 2.75, -1.0), (2.75, 3.1, 1.0), (3.1, 3.45, -1.0)):
        command[(time >= begin) & (time < end)] = sign
    truth = signal.lsim(servo, command, time)[1] - command
    means = [x.reshape(-1, 20).mean(axis=1) for x in (truth, *lagged_controls.of_record(time, command[:, None]).T)]
    X = np.stack(means[1:], axis=1)
    left = means[0] - X @ np.linalg.lstsq(X, means[0], rcond=None)[0]
    assert np.std(left) < 0.25 * np.std(means[0])


def test_what_a_servo_is_behind_by_acts_through_the_control_s_derivatives() -> None:
    """A block's coefficients with the elevator through the first lag, from those without it."""
    model = terms(AIRCRAFT, blocks.init(AIRCRAFT).layout)
    values = model.values.copy()
    servo, derivatives = model.servos["elevator"]
    values[servo[0]] = 1.0
    width, count = blocks.init(AIRCRAFT).layout.width, len(AIRCRAFT.controls) * len(LAGS)
    behind = np.arange(1.0, 1.0 + count)
    moved = design_of(model, values, np.zeros(width), behind) @ values
    expected = np.zeros(len(COEFFICIENTS))
    expected[model.output[derivatives]] = model.values[derivatives] * behind[0]
    assert np.count_nonzero(expected) == 3  # lift, drag and pitching moment
    np.testing.assert_allclose(moved, expected)


def test_a_block_holds_what_the_controls_are_behind_by() -> None:
    averaged, found = blocks.init(AIRCRAFT), []
    for k in range(60):
        sample = [0.0] * len(SAMPLE_COLUMNS) + [0.1 if k * STEP >= 0.1 else 0.0, 0.0, 0.0]
        sample[2], sample[6], sample[9] = -9.8, AIRCRAFT.reference.airspeed, AIRCRAFT.reference.air_density
        if (block := blocks.add(averaged, k * STEP, sample)) is not None:
            found.append(block.behind)
    ends = [(math.exp(-0.1 / lag) - 1.0) * 0.1 * lag / 0.1 for lag in LAGS]
    assert not found[0][2:].any()
    assert found[1] == pytest.approx([*ends, 0.0, 0.0, 0.0, 0.0], abs=3e-3)  # trapezia
