"""The band of an aircraft. Truth: modes that the documentation prints, from eigenvalues; and the literature."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, Derivative, ReferenceCondition, UncertainValue
from sysid_node.gap.flightdata.gap_flight import ANALYSIS_RATE
from sysid_node.gap.flightdata.time_scales import (
    analysis_rate,
    dutch_roll,
    highest_frequency,
    roll_subsidence,
    short_flight,
    short_period,
)
from sysid_node.sim import Simulator
from sysid_node.sim.simulator import LOWEST_RATE


def test_modes_are_those_of_the_eigenvalues() -> None:
    """cdrw: Dutch roll 0.90 Hz, roll subsidence 0.07 s by the equations of motion (aircraft_file.md)."""
    aircraft = load_aircraft("cdrw")
    assert dutch_roll(aircraft) == pytest.approx(0.9, rel=0.25)
    assert roll_subsidence(aircraft) == pytest.approx(1.0 / (2.0 * np.pi * 0.07), rel=0.2)


def test_modes_follow_the_airspeed() -> None:
    """All derivatives held, they are proportional to it."""
    aircraft = load_aircraft("cdrw")
    slow = replace(
        aircraft, reference=ReferenceCondition(0.5 * aircraft.reference.airspeed, aircraft.reference.air_density)
    )
    for mode in (short_period, dutch_roll, roll_subsidence):
        assert mode(slow) == pytest.approx(0.5 * mode(aircraft))


def heavier(times: float) -> Aircraft:
    """An aircraft whose modes are slower by the square root of so many times, and by so many times in roll."""
    aircraft = load_aircraft("cdrw")
    inertia = replace(aircraft.inertia, Ixx=times * aircraft.inertia.Ixx, Iyy=times * aircraft.inertia.Iyy,
                      Izz=times * aircraft.inertia.Izz)  # fmt: skip
    return replace(aircraft, inertia=inertia, mass=times * aircraft.mass)


@pytest.fixture(scope="module")
def heavy() -> Aircraft:
    return heavier(30.0)


def test_the_band_of_a_small_aircraft_is_the_widest_and_that_of_a_heavy_one_narrow(heavy: Aircraft) -> None:
    aircraft = load_aircraft("cdrw")
    assert highest_frequency(aircraft, lateral=True) == highest_frequency(aircraft, lateral=False) == 4.0
    assert highest_frequency(heavy, lateral=False) == pytest.approx(4.0 * short_period(heavy))
    assert highest_frequency(heavy, lateral=True) < 2.0


def test_a_narrow_band_needs_fewer_samples(heavy: Aircraft) -> None:
    """There are as many for each period of the highest frequency as those of a small aircraft."""
    aircraft, middling = load_aircraft("cdrw"), heavier(12.0)
    assert analysis_rate(aircraft, lateral=True) == ANALYSIS_RATE
    samples = ANALYSIS_RATE / highest_frequency(aircraft, lateral=False)
    of_middling = analysis_rate(middling, lateral=False) / highest_frequency(middling, lateral=False)
    assert samples <= of_middling < 1.1 * samples
    assert analysis_rate(heavier(300.0), lateral=False) == LOWEST_RATE
    vibrating = replace(heavy, effects={"structural_mode": {"frequency": UncertainValue(5.0)}})
    assert analysis_rate(vibrating, lateral=False) == ANALYSIS_RATE


def test_a_short_flight_is_a_short_period_or_two_seconds(heavy: Aircraft) -> None:
    assert short_flight(load_aircraft("cdrw")) == 2.0
    assert short_flight(heavy) == pytest.approx(1.0 / short_period(heavy))
    assert 3.0 < short_flight(heavy) < 4.0
    bare = replace(heavy, derivatives={**heavy.derivatives, "Cm_alpha": Derivative(0.0)})
    assert short_flight(bare) == 2.0


def test_a_file_without_a_pitching_slope_says_nothing_of_the_band() -> None:
    aircraft = load_aircraft("cdrw")
    bare = replace(aircraft, derivatives={**aircraft.derivatives, "Cm_alpha": Derivative(0.0)})
    assert highest_frequency(bare, lateral=True) == 4.0


@pytest.mark.slow
def test_the_simulator_is_stable_at_the_lowest_rate(heavy: Aircraft) -> None:
    """Its structural mode is solved exactly, whether an effect excites it or not."""
    simulator = Simulator(heavy, LOWEST_RATE)
    start = simulator.initial(airspeed=simulator.aircraft.reference.airspeed)
    commands = np.zeros((4000, len(simulator.commands)))
    flight = simulator.rollout(simulator.neutral(), start, simulator.inputs(commands))
    assert np.isfinite(flight.outputs).all()
