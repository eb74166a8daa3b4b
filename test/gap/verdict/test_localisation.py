"""Where the gap lies; truth: powers and series made by hand."""

import numpy as np
import pytest

from sysid_node.gap.verdict.localisation import binned_shape, regime_of, shortest_run, station_shares


def test_a_gap_lies_where_the_signal_departs_that_is_correlated_with_it(plain_model) -> None:
    """Power in proportion to how far the aileron, and nothing else as closely, departs in each window."""
    aileron = plain_model.record["da"]
    away = np.array([np.abs(aileron[w] - aileron.mean()).max() for w in plain_model.windows.slices])
    ((name, (low, high)),) = regime_of(plain_model, away**2).items()
    piece = aileron[plain_model.windows.slices[int(away.argmax())]]
    assert (name, low, high) == ("da", piece.min(), piece.max())


def test_a_gap_that_is_the_same_in_every_window_has_no_regime(plain_model) -> None:
    assert regime_of(plain_model, np.ones(plain_model.windows.count)) == {}


@pytest.mark.parametrize(
    ("power", "run"),
    [
        ([0.0, 9.0, 1.0, 0.0], (1, 1)),
        ([0.0, 8.0, 1.0, 1.0], (1, 1)),  # exactly the share
        ([0.0, 7.9, 1.0, 1.1], (1, 2)),  # just below it; one more bin of either side is enough
        ([1.0, 1.0, 1.0, 1.0], (0, 3)),
        ([5.0, 0.0, 0.0, 5.0], (0, 3)),
        ([4.0, 4.0, 0.0, 1.0, 1.0], (0, 1)),
        ([0.0, 0.0, 0.0], (0, 0)),
    ],
)
def test_the_shortest_run_that_holds_most_of_the_power(power: list[float], run: tuple[int, int]) -> None:
    assert shortest_run(np.array(power)) == run


def test_shares_of_the_stations_add_up_to_one() -> None:
    """Two channels; the actuator removes 6 of 10 on the first, derivatives 2 on each, half of the rest is structure."""
    powers = np.array([[10.0, 4.0], [4.0, 5.0], [2.0, 3.0]])
    shares = dict(station_shares(["actuator", "aerodynamics"], powers, np.array([0.5, 0.5])))
    parts = {
        ("actuator", 0): 6.0,
        ("aerodynamics", 0): 2.0,
        ("aerodynamics", 1): 2.0,
        ("unexplained", 0): 1.0,
        ("noise", 0): 1.0,
        ("unexplained", 1): 1.5,
        ("noise", 1): 1.5,
    }
    assert shares == pytest.approx({key: part / 15.0 for key, part in parts.items()})
    assert list(shares.values()) == sorted(shares.values(), reverse=True)


def test_two_effects_at_one_station_are_one_share() -> None:
    powers = np.array([[10.0], [6.0], [1.0], [1.0]])
    ((key, share), _) = station_shares(["sensors", "sensors", "aerodynamics"], powers, np.zeros(1))
    assert (key, share) == (("sensors", 0), pytest.approx(0.9))


def test_no_gap_has_no_shares() -> None:
    assert station_shares(["aerodynamics"], np.zeros((2, 12)), np.zeros(12)) == []


def test_the_shape_of_a_missing_coefficient_is_found_in_bins() -> None:
    """A slope in alpha with noise that keeps its value for a quarter of a second; of a line, 12 bins lack 1/144."""
    random = np.random.default_rng(4)
    noise = np.repeat(0.01 * random.standard_normal(480), 12)
    alpha = random.uniform(-0.2, 0.2, noise.size)
    shape = binned_shape("Cm", "alpha", "rad", alpha, 0.5 * alpha + noise, 50.0)
    assert (shape.axis, shape.signal, shape.unit) == ("Cm", "alpha", "rad")
    assert shape.centres.size == 12 and np.abs((shape.means - 0.5 * shape.centres) / shape.errors).max() < 3.0
    line = np.var(0.5 * alpha)
    assert shape.explained == pytest.approx((1.0 - 1.0 / 144.0) * line / (line + np.var(noise)), abs=0.01)


def test_a_signal_that_explains_nothing_explains_nothing() -> None:
    random = np.random.default_rng(5)
    shape = binned_shape("Cm", "p", "rad/s", random.standard_normal(4000), random.standard_normal(4000), 50.0)
    assert shape.explained < 0.01
