"""Bounds and priors of parameters; truth: the effects' own definitions, and what is said beside them."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.residuals.parameter_priors import bounds, prior
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def simulator(aircraft) -> Simulator:
    return Simulator(aircraft, 50.0)


def test_most_bounds_are_the_effects_own(simulator) -> None:
    index = simulator.names.index("mass_error.error")
    _, parameter = simulator.parameters[index]
    low, high = bounds(simulator, [index])
    assert (low[0], high[0]) == (parameter.lower, parameter.upper)


@pytest.mark.parametrize(
    ("name", "lowest"),
    [
        ("imu_delay.delay", 0.0),
        ("actuator_stamp_delay.delay", 0.0),
        ("structural_mode.frequency", 3.0),
        ("stuck_surface.elevator", 0.95),
    ],
)
def test_some_lower_bounds_are_narrower(simulator, name: str, lowest: float) -> None:
    low, _ = bounds(simulator, [simulator.names.index(name)])
    assert low[0] == lowest


def test_instruments_may_be_off_their_place_in_proportion_to_the_span(aircraft) -> None:
    """A transport's nose boom reaches 13 m ahead of its CG (docs/results/real_flights.md, ATTAS: span 21.5 m)."""
    large = Simulator(replace(aircraft, geometry=replace(aircraft.geometry, b=21.5)), 50.0)
    low, high = bounds(large, [large.names.index("vane_lever_arm.x")])
    assert low[0] < -13.0 and high[0] > 13.0
    small, index = Simulator(aircraft, 50.0), large.names.index("imu_lever_arm.x")
    ratio = 21.5 / aircraft.geometry.b
    assert large.scales[index] == pytest.approx(ratio * small.scales[index])
    assert bounds(large, [index])[1][0] == pytest.approx(ratio * bounds(small, [index])[1][0])
    assert large.scales[large.names.index("mass_error.error")] == small.scales[small.names.index("mass_error.error")]


def test_a_servo_of_second_order_has_a_damping_that_servos_have(simulator) -> None:
    low, high = bounds(simulator, [simulator.names.index("actuator_lag.damping")])
    assert (low[0], high[0]) == (0.3, 1.0)


def test_every_neutral_value_but_of_a_jam_a_mode_and_a_damping_lies_within_its_bounds(simulator) -> None:
    apart = ("stuck_surface", "structural_mode", "actuator_lag.damping")
    indices = [i for i, name in enumerate(simulator.names) if not name.startswith(apart)]
    low, high = bounds(simulator, indices)
    neutral = simulator.neutral()[indices]
    assert ((low <= neutral) & (neutral <= high)).all()


def test_priors_are_centred_on_neutral_and_an_onset_may_be_at_any_time(simulator) -> None:
    names = ["cg_shift.x", "control_effectiveness_loss.onset"]
    indices = [simulator.names.index(name) for name in names]
    centre, sigma = prior(simulator, indices)
    np.testing.assert_array_equal(centre, simulator.neutral()[indices])
    np.testing.assert_allclose(sigma, [3.0 * simulator.scales[indices[0]], 100.0])
