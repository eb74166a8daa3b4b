"""Aircraft of other sizes. Truth: level flight and stiffness in pitch by hand, published dimensions."""

import pytest

from bench.withheld.drawing import SUITES_OF, draw, seconds_of
from bench.withheld.plants.instruments import USUAL
from bench.withheld.plants.sizes import SHAPE, SIZES, chord, sized, slower
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import GRAVITY


def lift_coefficient(aircraft: Aircraft) -> float:
    """In level flight at the reference condition."""
    reference = aircraft.reference
    return aircraft.mass * GRAVITY / (0.5 * reference.air_density * reference.airspeed**2 * aircraft.geometry.S)


def stiffness(aircraft: Aircraft) -> float:
    """Angular acceleration in pitch for each radian of the angle of attack, 1/s^2."""
    reference, geometry = aircraft.reference, aircraft.geometry
    pressure = 0.5 * reference.air_density * reference.airspeed**2
    return aircraft.derivatives["Cm_alpha"].value * pressure * geometry.S * geometry.cbar / aircraft.inertia.Iyy


@pytest.mark.parametrize("name", SIZES)
def test_a_size_flies_level_as_the_shape_does_and_answers_as_much_slower_as_it_is_larger(name: str) -> None:
    shape, found = load_aircraft(SHAPE), sized(name)
    assert lift_coefficient(found) == pytest.approx(lift_coefficient(shape))
    assert stiffness(shape) / stiffness(found) == pytest.approx(slower(name) ** 2)
    assert chord(name) == pytest.approx(found.geometry.cbar)


def test_the_transport_is_about_as_large_as_one_that_flies() -> None:
    """VFW-614: span 21.5 m, wing area 64 m^2 (Jane's All the World's Aircraft 1975-76)."""
    geometry = sized("transport").geometry
    assert geometry.b == pytest.approx(21.5, rel=0.1)
    assert pytest.approx(64.0, rel=0.15) == geometry.S


def test_sizes_are_drawn_in_their_own_sets() -> None:
    cases = [draw("sizes", seed) for seed in range(40)]
    assert {case.plant for case in cases} == set(SIZES)
    assert all(case.suite in SUITES_OF[case.plant] for case in cases)
    usual = [draw("final", seed) for seed in range(40)]
    assert not {case.plant for case in usual} & set(SIZES)
    assert {case.suite for case in usual} == set(USUAL)
    assert seconds_of("transport") > 2.0 * seconds_of(SHAPE) == 2.0 * seconds_of("foamie")
