"""The slopes are 1 where all is right. Truth: a body whose readings follow from its motion by hand."""

import math

import numpy as np
import pytest
from moving_body import NAMES, readings

from sysid_node.flight.live.kinematic_relations import RELATIONS, Agreement, KinematicRelations


def relations(factors: dict[str, float] | None = None, seconds: float = 60.0, pieces: int = 1) -> KinematicRelations:
    """Of the moving body, whose readings are multiplied by factors, in so many pieces."""
    time, columns = readings(seconds)
    table = np.column_stack([(factors or {}).get(name, 1.0) * columns[name] for name in NAMES])
    found = KinematicRelations()
    for rows in np.array_split(np.arange(time.size), pieces):
        found.add(time[rows], table[rows, :6], table[rows, 6:9], table[rows, 9:])
    return found


@pytest.mark.parametrize("relation", RELATIONS)
def test_slopes_are_one(relation: str) -> None:
    seen = relations().agreement(relation)
    assert (seen.slope, seen.inverse, seen.correlation) == pytest.approx((1.0, 1.0, 1.0), abs=2e-3)
    assert seen.score > 20.0


@pytest.mark.parametrize("pieces", [7, 600])
def test_pieces_of_any_length_give_the_same(pieces: int) -> None:
    whole, parts = relations(), relations(pieces=pieces)
    for name in RELATIONS:
        assert parts.agreement(name) == pytest.approx(whole.agreement(name), rel=1e-6)


@pytest.mark.parametrize(
    ("factors", "relation", "slope"),
    [
        ({"p": -1.0, "q": -1.0, "r": -1.0}, "roll", -1.0),
        ({"q": -1.0, "r": -1.0}, "pitch", -1.0),
        ({"V": 2.0}, "vertical", 0.5),
        ({"beta": -1.0, "p": 1.0}, "beta", -1.0),
        ({"alpha": -1.0}, "alpha", -1.0),
        ({"p": 57.3, "q": 57.3, "r": 57.3}, "yaw", 1 / 57.3),
    ],
)
def test_a_factor_of_a_reading_is_the_slopes(factors: dict[str, float], relation: str, slope: float) -> None:
    assert relations(factors).agreement(relation).slope == pytest.approx(slope, rel=0.03)


def test_biases_and_arms_of_instruments_are_regressed_along() -> None:
    """An IMU 0.5 m ahead of the CG, 0.3 m to the right, and 0.2 m/s^2 off; a vane 0.4 m ahead, 0.7 m to the right."""
    time, c = readings()
    p_rate, q_rate, r_rate = (np.gradient(c[rate], time) for rate in "pqr")
    c["az"] = c["az"] + 0.2 - 0.5 * q_rate + 0.3 * p_rate
    c["ay"] = c["ay"] - 0.2 + 0.5 * r_rate
    c["alpha"] = c["alpha"] + (0.7 * c["p"] - 0.4 * c["q"]) / c["V"]
    table = np.column_stack([c[name] for name in NAMES])
    found = KinematicRelations()
    found.add(time, table[:, :6], table[:, 6:9], table[:, 9:])
    for relation in ("vertical", "lateral", "alpha", "beta"):
        assert found.agreement(relation).slope == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    ("missing", "told"),
    [
        (("phi", "theta", "psi"), {"vertical", "alpha"}),
        (("psi",), {"roll", "pitch", "vertical", "lateral", "alpha", "beta"}),
        (("alpha", "beta"), {"roll", "pitch", "yaw", "vertical", "lateral"}),
        (("V",), set()),
    ],
)
def test_what_is_not_measured_tells_nothing(missing: tuple[str, ...], told: set[str]) -> None:
    found = relations(dict.fromkeys(missing, math.nan))
    assert {name for name in RELATIONS if found.agreement(name) != Agreement()} == told


def test_an_attitude_that_stands_still_tells_nothing() -> None:
    found = relations({"phi": 0.0, "theta": 0.0, "psi": 0.0})
    assert {name for name in RELATIONS if found.agreement(name) != Agreement()} == {"vertical", "alpha"}


def test_a_short_flight_tells_nothing() -> None:
    found = relations(seconds=8.0)
    assert all(found.agreement(name) == Agreement() for name in RELATIONS)


def test_a_heading_that_passes_north_and_a_hole_do_no_harm() -> None:
    time, columns = readings()
    columns["psi"] = np.remainder(columns["psi"] + math.pi, 2.0 * math.pi)
    table = np.column_stack([columns[name] for name in NAMES])
    table[1000:1100, 4] = math.nan
    kept = np.r_[0:3000, 3500 : time.size]
    found = KinematicRelations()
    found.add(time[kept], table[kept, :6], table[kept, 6:9], table[kept, 9:])
    assert found.agreement("yaw").slope == pytest.approx(1.0, abs=2e-3)
    assert found.agreement("pitch").slope == pytest.approx(1.0, abs=2e-3)


def test_nothing_moves() -> None:
    found = KinematicRelations()
    time = np.arange(0.0, 60.0, 0.01)
    still = np.zeros((time.size, 6))
    still[:, 2] = -9.80665
    found.add(time, still, np.column_stack([np.full(time.size, 18.0), still[:, :2]]), still[:, 3:])
    assert all(found.agreement(name) == Agreement() for name in RELATIONS)
