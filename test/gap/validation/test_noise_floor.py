"""The noise floor by simulation; truth: the error of the true simulator beside its own flight."""

import numpy as np
import pytest

from sysid_node.gap.short_flights.multiple_shooting import course_of, simulation_error
from sysid_node.gap.validation.noise_floor import noise_floor_errors
from sysid_node.sim.model.layout import OUTPUTS

READ = [OUTPUTS.index(name) for name in ("p", "q", "r", "alpha")]


@pytest.fixture(scope="module")
def floor(plain_model):
    course = course_of(plain_model, 100)
    return list(noise_floor_errors(plain_model, plain_model.simulator.neutral(), course))


def test_the_floor_is_what_the_true_simulator_leaves(plain_model, floor) -> None:
    """In still air, of a flight that this simulator flew itself; rms by reading.

    The floor also allows for commands that step anywhere between two messages. Those of this flight do not, so that it
    is higher for the angular rates.
    """
    mine = simulation_error(plain_model, plain_model.simulator.neutral(), course_of(plain_model, 100))
    errors = np.sqrt(np.mean([(error**2).mean(axis=0) for error, _ in floor], axis=0))
    ratio = (errors / np.maximum(np.sqrt((mine**2).mean(axis=0)), 1e-12))[READ]
    assert ratio[3] == pytest.approx(1.0, abs=0.2)
    assert ((ratio[:3] > 1.0) & (ratio[:3] < 2.5)).all()


def test_realisations_differ_and_come_again_by_their_seed(plain_model, floor) -> None:
    (first, noise), (second, _), *_ = floor
    assert len(floor) == 6 and np.abs(first - second)[:, READ].max() > 0.0
    course = course_of(plain_model, 100)
    again, noise_again = next(noise_floor_errors(plain_model, plain_model.simulator.neutral(), course))
    np.testing.assert_array_equal(again, first)
    np.testing.assert_array_equal(noise_again, noise)


def test_the_noise_that_is_added_is_the_sensors(plain_model, floor, aircraft) -> None:
    """The gyros' of the aircraft file, less what the low-pass takes: between a fifth and all of it."""
    gyro = np.std([noise[:, READ[:3]] for _, noise in floor])
    assert 0.2 * aircraft.noise["gyro"] < gyro < aircraft.noise["gyro"]
