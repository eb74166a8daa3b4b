"""The airspeed between its samples."""

import numpy as np
import pytest

from sysid_node.flight.logs.air_data import airspeed_between_samples

G = 9.80665


def test_motion_between_samples_is_recovered():
    """Truth: V(t) is given, and the specific force follows from V' = ax - g sin(theta), wings level, alpha 0."""
    time = np.arange(0.0, 40.0, 0.01)
    theta = 0.1 * np.sin(1.3 * time)
    speed = 18.0 + 1.5 * np.sin(2.0 * time) + 0.5 * np.sin(5.0 * time)
    slope = 3.0 * np.cos(2.0 * time) + 2.5 * np.cos(5.0 * time)
    force = np.column_stack([slope + G * np.sin(theta), 0.0 * time, -G * np.cos(theta)])
    euler = np.column_stack([0.0 * time, theta, 0.0 * time])
    every = slice(0, None, 100)
    back = airspeed_between_samples(time, force, euler, time[every], speed[every])
    np.testing.assert_allclose(back[:3901], speed[:3901], atol=0.01)
    line = np.interp(time, time[every], speed[every])
    assert np.std(line[:3901] - speed[:3901]) > 0.3


def test_a_constant_angle_of_attack_and_a_bias_are_fitted():
    """Truth: at the angle of attack 0.1 a load factor n adds 0.1 (1 - n) g; the accelerometer reads 0.3 too much."""
    time = np.arange(0.0, 60.0, 0.01)
    load = 1.0 + 0.4 * np.sin(2.2 * time)
    slope = 0.1 * G * (1.0 - load)
    speed = 18.0 + np.concatenate([[0.0], np.cumsum(0.005 * (slope[1:] + slope[:-1]))])
    force = np.column_stack([0.3 + 0.0 * time, 0.0 * time, -G * load])
    every = slice(0, None, 100)
    back = airspeed_between_samples(time, force, np.zeros((time.size, 3)), time[every], speed[every])
    np.testing.assert_allclose(back[:5901], speed[:5901], atol=1e-3)


@pytest.mark.parametrize("pauses", ["both", "the IMU"])
def test_a_pause_is_not_fitted(pauses):
    """Truth: as above; for ten minutes nothing is logged, or no IMU, and the airspeed is another one then."""
    time = np.arange(0.0, 60.0, 0.01)
    load = 1.0 + 0.4 * np.sin(2.2 * time)
    slope = 0.1 * G * (1.0 - load)
    speed = 18.0 + np.concatenate([[0.0], np.cumsum(0.005 * (slope[1:] + slope[:-1]))])
    speed[3050:] += 4.0
    force = np.column_stack([0.3 + 0.0 * time, 0.0 * time, -G * load])
    later = np.where(np.arange(time.size) >= 3050, time + 600.0, time)
    sampled, speeds = later[::50], speed[::50]
    if pauses == "the IMU":
        sampled = np.concatenate([sampled[:61], np.arange(31.0, 630.4, 0.5), sampled[61:]])
        speeds = np.concatenate([speeds[:61], 20.0 + 0.01 * np.arange(31.0, 630.4, 0.5), speeds[61:]])
    back = airspeed_between_samples(later, force, np.zeros((time.size, 3)), sampled, speeds)
    measured = (np.arange(time.size) < 3000) | ((np.arange(time.size) >= 3050) & (np.arange(time.size) < 5950))
    np.testing.assert_allclose(back[measured], speed[measured], atol=1e-3)


def test_without_attitude_it_is_the_line():
    time = np.arange(0.0, 5.0, 0.01)
    unknown = np.full((time.size, 3), np.nan)
    back = airspeed_between_samples(time, np.ones((time.size, 3)), unknown, time[::100], np.arange(5.0))
    np.testing.assert_allclose(back[:401], time[:401])
