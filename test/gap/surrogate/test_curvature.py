"""Tables for what derivatives leave; truth: coefficients with and without a kink that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.names import COEFFICIENTS, split_derivative
from sysid_node.gap.surrogate.curvature import Residual, curves

AIRCRAFT = load_aircraft("cdrw")
NAMES = list(AIRCRAFT.derivatives)


def residual(kink: float, seed: int) -> Residual:
    """What is left of random motion where Cm has a kink at an angle of attack of 0.1 rad, and CL a wrong slope."""
    random = np.random.default_rng(seed)
    regressors = dict.fromkeys(("alpha", "beta", "p", "q", "r", "de", "da", "dr"))
    motion = {name: 0.1 * random.uniform(-1.0, 2.0, 3000) for name in regressors} | {"0": np.ones(3000)}
    slopes = np.zeros((3000, len(COEFFICIENTS), len(NAMES)))
    for i, name in enumerate(NAMES):
        coefficient, regressor = split_derivative(name)
        slopes[:, COEFFICIENTS.index(coefficient), i] = motion[regressor]
    left = 1e-4 * random.standard_normal((3000, len(COEFFICIENTS)))
    left[:, COEFFICIENTS.index("CL")] += 0.3 * motion["alpha"]
    left[:, COEFFICIENTS.index("Cm")] += kink * np.maximum(motion["alpha"] - 0.1, 0.0)
    return Residual(left, slopes, left + slopes.sum(axis=2))


def test_a_kink_gives_one_table_with_its_shape() -> None:
    (found,) = curves(AIRCRAFT, residual(-0.5, 1), residual(-0.5, 2))
    assert (found.coefficient, found.variable) == ("Cm", "alpha")
    table = found.table
    truth = -0.5 * np.maximum(found.points - 0.1, 0.0)
    straight = np.polyval(np.polyfit(found.points, truth, 1), found.points)
    np.testing.assert_allclose(table.values, truth - straight, atol=0.15 * np.ptp(truth - straight))


def test_a_wrong_slope_alone_is_the_derivatives() -> None:
    assert curves(AIRCRAFT, residual(0.0, 1), residual(0.0, 2)) == []


def test_a_kink_that_other_flight_does_not_show_gives_no_table() -> None:
    assert curves(AIRCRAFT, residual(-0.5, 1), residual(0.0, 2)) == []


def test_the_table_has_no_straight_part() -> None:
    (found,) = curves(AIRCRAFT, residual(-0.5, 1), residual(-0.5, 2))
    assert np.polyfit(found.points, found.values, 1) == pytest.approx([0.0, 0.0], abs=1e-9)


def in_thrust(seed: int) -> Residual:
    """What a propeller's thrust leaves of the drag: it falls with the airspeed, and an autopilot adds throttle then."""
    plain, random = residual(0.0, seed), np.random.default_rng(100 + seed)
    slow, other = random.standard_normal((2, 3000))
    V, throttle = 20.0 - slow, 0.5 + 0.1 * slow + 0.02 * other
    left = plain.left.copy()
    left[:, COEFFICIENTS.index("CD")] += 0.02 * (V - 20.0) + 0.2 * (throttle - 0.5)
    return replace(plain, left=left, measured=left + plain.slopes.sum(axis=2), thrust={"V": V, "throttle": throttle})


def test_airspeed_and_throttle_are_found_together_though_each_alone_explains_little() -> None:
    first, second = in_thrust(1), in_thrust(2)
    found = curves(AIRCRAFT, first, second)
    assert [(curve.coefficient, curve.variable) for curve in found] == [("CD", "V"), ("CD", "throttle")]
    slopes = [np.polyfit(curve.points, curve.values, 1)[0] for curve in found]
    assert slopes == pytest.approx([0.02, 0.2], rel=0.1)
    alone = replace(first, thrust={"V": first.thrust["V"]}), replace(second, thrust={"V": second.thrust["V"]})
    assert curves(AIRCRAFT, *alone) == []


def test_without_metered_thrust_there_is_no_table_over_it() -> None:
    first, second = (replace(in_thrust(seed), thrust={}) for seed in (1, 2))
    assert curves(AIRCRAFT, first, second) == []
