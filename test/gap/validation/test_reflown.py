"""The gap as another simulator flies it. Truth: simulators that fly exactly as measured, and not at all."""

import numpy as np
import pytest

from sysid_node.dynamics.attitude import euler_angles
from sysid_node.gap.validation.reflown import reflown
from sysid_node.sim.correcting.jsbsim_flight import FlownMotion


class Replay:
    """A simulator that moves through the states it could begin from, as measured: it has no error of its own."""

    def fly_short(self, begins, body, commands, air, rate):
        attitude = np.unwrap(np.column_stack(euler_angles(tuple(body[:, 6:10].T), np)), axis=0)
        velocity, rates = body[:, 3:6], body[:, 10:13]
        phi, theta, _ = attitude.T
        down = np.column_stack([-np.sin(theta), np.sin(phi) * np.cos(theta), np.cos(phi) * np.cos(theta)])
        changing = np.gradient(velocity + air, 1.0 / rate, axis=0)
        force = changing + np.cross(rates, velocity) - 9.80665 * down
        return FlownMotion(force, np.gradient(rates, 1.0 / rate, axis=0), rates, attitude, velocity)


class StandStill(Replay):
    """A simulator that keeps the state with which each short flight begins."""

    def fly_short(self, begins, body, commands, air, rate):
        held = body[np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))]
        flown = super().fly_short(begins, held, commands, 0.0 * air, rate)
        still = np.zeros_like(flown.rates)
        return FlownMotion(0.0 * flown.force, still, flown.rates, flown.attitude, flown.velocity)


class Lost(Replay):
    """A simulator that cannot go on."""

    def fly_short(self, begins, body, commands, air, rate):
        flown = super().fly_short(begins, body, commands, air, rate)
        return FlownMotion(np.nan * flown.force, flown.turning, flown.rates, flown.attitude, flown.velocity)


def test_a_simulator_that_flies_as_measured_closes_the_gap(plain_model):
    neutral = plain_model.simulator.neutral()
    result = reflown([plain_model], [neutral], StandStill(), Replay())
    assert result.gap.after < 0.3 * result.gap.before
    for name in ("q", "theta", "alpha", "V"):
        channel = result.gap.per_channel[name]
        assert channel["after"] < 0.15 and channel["before"] > 0.5, name
    low, high = result.gap.ci95
    assert low < result.gap.shrink_percent < high or result.gap.shrink_percent == pytest.approx(100.0, abs=5.0)
    (flight,) = result.flights
    assert flight.measured.shape == flight.before.shape == (len(plain_model.record), 12)
    assert reflown([plain_model], [neutral], Lost(), Replay()) is None
