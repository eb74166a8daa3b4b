"""How far a gap shrinks, by errors before, within tolerances, after, and of noise alone; truth: by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid_node.aircraft.model import Geometry, Inertia
from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.gap.validation.spectral_error import Gap, gap_of, interval, shrinkage, within_tolerances


def test_what_is_closed_is_a_share_of_what_could_be() -> None:
    errors = np.array([[0.5, 0.4, 0.2, 0.1], [0.5, 0.4, 0.6, 0.1], [0.1, 0.1, 0.1, 0.1]])
    np.testing.assert_allclose(shrinkage(errors), [75.0, -25.0, 0.0])


def test_all_is_never_more_than_all() -> None:
    """By rounding, 100 (before - floor) / (before - floor) is more than 100 for some."""
    random = np.random.default_rng(1)
    before = random.uniform(0.1, 3.0, 10000)
    floor = before * random.uniform(0.0, 0.9, 10000)
    np.testing.assert_array_equal(shrinkage(np.stack([before, before, floor, floor], axis=-1)), 100.0)


def gap_with(tolerances: float) -> Gap:
    """A gap whose errors within tolerances are this; of the other numbers each is its own."""
    rows = {"q": {"before": 0.6, "tolerances": tolerances, "after": 0.1, "noise_floor": 0.05}}
    ends = {"before": (0.5, 0.7), "tolerances": (tolerances, 1.0), "after": (0.0, 0.2), "noise_floor": (0.0, 0.1)}
    return Gap(0.6, tolerances, 0.1, 0.05, 90.0, (80.0, 95.0), rows, ends)


@pytest.mark.parametrize(("fitted", "stated"), [(0.4, 0.4), (0.7, 0.6)])
def test_within_tolerances_the_better_of_fitted_and_filed_derivatives_is_stated(fitted: float, stated: float) -> None:
    assert within_tolerances(gap_with(0.6), gap_with(fitted)) == gap_with(stated)


class Windows:
    """Four windows of a flight."""

    count = 4


#: An aircraft whose surfaces command nothing, so that all of its motions count.
GLIDER = SimpleNamespace(
    geometry=Geometry(1.0, 1.0, 1.0), inertia=Inertia(1.0, 1.0, 1.0), derivatives={}, control_symbols=(), throttle=None
)


def flight(error: float) -> Any:
    """Of a motion with a power of 12 a window (three lines), and an error as a share of it, on the channels CL and V.

    The file's own residual is half the motion; the sensors' noise has a power of 0.03 a window.
    """
    measured, before, residual = (np.zeros((4, 4, 12), complex) for _ in range(3))
    channels = [CHANNELS.index("CL"), CHANNELS.index("V")]
    measured[:, 1:, channels] = 2.0
    before[:, 1:, channels], residual[:, 1:, channels] = 1.0, 2.0 * error
    axes = np.zeros(12, bool)
    axes[channels] = True
    model = SimpleNamespace(
        measured=measured, noise=np.full((4, 12), 0.01) * [[0.0], [1.0], [1.0], [1.0]], axes=axes, windows=Windows,
        residual=lambda theta: before, simulator=SimpleNamespace(neutral=lambda: np.zeros(1), aircraft=GLIDER),
        record={"rho": np.ones(4), "V": np.ones(4)}, commands=np.zeros((4, 1)),
    )  # fmt: skip
    return SimpleNamespace(model=model, residual=residual)


def evidence(error: float) -> Any:
    return SimpleNamespace(flights=(flight(error),))


def structure(share: float) -> Any:
    """A test in which a share of what is left is structure, for certain."""
    return SimpleNamespace(share=np.full(12, share), beyond=np.full(12, share), chance=np.zeros(12), total=np.ones(12))


@pytest.mark.parametrize(("share", "floor"), [(1.0, np.sqrt(0.03 / 12.0)), (0.0, 0.2), (0.75, 0.1)])
def test_errors_are_shares_of_the_motion_and_the_floor_is_what_is_no_structure(share: float, floor: float) -> None:
    """By hand; the floor is never less than the sensors' noise."""
    gap = gap_of(evidence(0.4), evidence(0.2), structure(share))
    assert (gap.before, gap.tolerances, gap.after) == pytest.approx((0.5, 0.4, 0.2))
    assert gap.noise_floor == pytest.approx(floor)
    assert gap.shrink_percent == pytest.approx(100.0 * 0.3 / (0.5 - floor))
    assert set(gap.per_channel) == {"CL", "V"}
    assert gap.per_channel["V"]["after"] == pytest.approx(0.2)


def test_the_order_of_flights_does_not_matter_where_one_lacks_a_channel() -> None:
    """What one flight does not measure is compared in none, as in short flights; the other channel is as before."""

    def of(*flights: Any) -> Gap:
        pair = SimpleNamespace(flights=flights)
        return gap_of(pair, pair, structure(1.0))

    whole, part = flight(0.2), flight(0.4)
    part.model.axes[CHANNELS.index("V")] = False
    part.residual[..., CHANNELS.index("V")] = 0.0
    gap, reversed_order = of(whole, part), of(part, whole)
    assert (reversed_order.before, reversed_order.after) == pytest.approx((gap.before, gap.after))
    assert set(gap.per_channel) == {"CL"}
    assert gap.after == pytest.approx(np.sqrt((0.2**2 + 0.4**2) / 2.0))


def test_what_is_left_is_never_below_its_noise_floor() -> None:
    """Errors below the sensors' noise: the noise of the windows was less than its mean."""
    gap = gap_of(evidence(0.04), evidence(0.02), structure(1.0))
    assert gap.noise_floor == pytest.approx(0.02) and gap.shrink_percent == pytest.approx(100.0)


def test_groups_that_are_all_alike_leave_no_doubt() -> None:
    gap = gap_of(evidence(0.4), evidence(0.2), structure(0.75))
    assert gap.ci95 == pytest.approx((gap.shrink_percent, gap.shrink_percent))
    assert gap.intervals["after"] == pytest.approx((0.2, 0.2))


def test_a_flight_in_which_nothing_moved_has_no_error() -> None:
    still = evidence(0.2)
    still.flights[0].model.measured[:] = 0.0
    gap = gap_of(still, still, structure(1.0))
    assert (gap.before, gap.after, gap.shrink_percent, gap.per_channel) == (0.0, 0.0, 0.0, {})


def test_an_interval_holds_95_percent_of_the_draws() -> None:
    low, high = interval(np.arange(10001.0))
    assert (low, high) == pytest.approx((250.0, 9750.0))
