"""Attitudes against sysid_node.flight.frames, and against SciPy's rotations."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sysid_node.flight.autopilots.attitude import Attitude, LastAttitude, normalised, other_axes, propagated
from sysid_node.flight.frames import euler_from_quaternion


def random_attitudes(count: int) -> list[Attitude]:
    return [Attitude(*q) for q in np.roll(Rotation.random(count, random_state=1).as_quat(), 1, axis=1).tolist()]


def test_other_axes_give_the_same_euler_angles_and_lead_back() -> None:
    for attitude in random_attitudes(20):
        there = other_axes(attitude)
        angles = [euler_from_quaternion(np.roll([q], -1, axis=1), f) for q, f in ((attitude, "frd"), (there, "flu"))]
        np.testing.assert_allclose(*angles, atol=1e-12)
        back = np.array(other_axes(there))
        np.testing.assert_allclose(back * np.sign(back[0] * attitude[0]), attitude, atol=1e-12)


@pytest.mark.parametrize("seconds", [0.0, 0.03, -0.02])
def test_carried_by_body_rates(seconds: float) -> None:
    rates = (0.7, -1.1, 2.0)
    for w, x, y, z in random_attitudes(5):
        expected = (Rotation.from_quat([x, y, z, w]) * Rotation.from_rotvec(np.multiply(rates, seconds))).as_matrix()
        got = np.roll(propagated(Attitude(w, x, y, z), rates, seconds), -1)
        np.testing.assert_allclose(Rotation.from_quat(got).as_matrix(), expected, atol=1e-12)
    assert propagated(Attitude(1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), seconds) == (1.0, 0.0, 0.0, 0.0)


def test_what_is_no_attitude_is_none() -> None:
    assert normalised(Attitude(0.0, 0.0, 0.0, 0.0)) is None
    assert normalised(Attitude(float("nan"), 0.0, 0.0, 0.0)) is None
    assert normalised(Attitude(1.005, 0.0, 0.0, 0.0)) == (1.0, 0.0, 0.0, 0.0)
    last = LastAttitude()
    assert last.at(0, (0.0, 0.0, 0.0)) is None
    last.heard(0, Attitude(1.0, 0.0, 0.0, 0.0))
    assert last.at(100_000_000, (0.0, 0.0, 0.0)) is not None
    assert last.at(-101_000_000, (0.0, 0.0, 0.0)) is None


@pytest.mark.parametrize("rate", [math.inf, -math.inf, math.nan, 1e200])
def test_there_is_no_attitude_at_rates_that_no_aircraft_has(rate: float) -> None:
    """The sine of an infinite angle used to end the adapter."""
    last = LastAttitude()
    last.heard(0, Attitude(1.0, 0.0, 0.0, 0.0))
    assert last.at(1_000_000, (0.0, rate, 0.0)) is None
