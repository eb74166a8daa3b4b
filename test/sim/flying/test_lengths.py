"""Flights padded to few lengths; truth: a flight of the whole length, and the shift of readings that end."""

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import Simulator
from sysid_node.sim.flying.lengths import padded_length
from sysid_node.sim.flying.trim import trim_flight
from sysid_node.sim.signals.time_shift import shift_cubic


@pytest.mark.parametrize(
    ("samples", "length"),
    [(1, 768), (768, 768), (769, 1536), (3001, 3072), (6001, 6144), (12289, 24576), (24577, 36864)],
)
def test_many_lengths_share_few_programs(samples: int, length: int) -> None:
    assert padded_length(samples) == length


def test_a_padded_flight_is_the_flight_itself() -> None:
    """It is the beginning of a longer one, and a late IMU's readings are interpolated up to its own last sample."""
    simulator = Simulator(load_aircraft("cdrw"), 50.0)
    trim = trim_flight(simulator)
    commands = np.tile(trim.command, (768, 1))
    commands[20:, 0] += 0.03 * np.sin(0.1 * np.arange(748))

    def fly(samples: int, delay: float):
        lateness = {"imu_delay": {"delay": delay}} if delay else {}
        theta = simulator.vector({**lateness, "command_delay": {"delay": 0.03}})
        return simulator.rollout(theta, trim.initial, simulator.inputs(commands[:samples]))

    whole, part, late = fly(768, 0.0), fly(101, 0.0), fly(101, 0.013)
    for series, longer in zip(part, whole, strict=True):
        np.testing.assert_array_equal(series, longer[:101])
    expected = shift_cubic(part.outputs[:, :9], 0.013 * 50.0)
    np.testing.assert_allclose(late.outputs[:, :9], expected, rtol=0.0, atol=1e-11)
