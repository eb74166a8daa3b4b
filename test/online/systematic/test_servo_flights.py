"""Servos and derivatives from commands in flights of this package's simulator; truth: what was flown.

``kestrel`` pitches as fast as its servo moves, and its airspeed changes by a fifth during a pulse: where the flow's
noise, or the dynamic pressure's rate, is taken for the servo's, elevator and damping exchange their times.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.systematic.budget import Budget
from sysid_node.online.types import Estimates
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie

LATE = 0.05  # s, of first order; the aircraft file does not say so
KESTREL = load_aircraft("kestrel")


@cache
def estimated(noise: float, method: str, seed: int) -> Estimates:
    """The estimates at the end of three 3-2-1-1s on each surface, with so many times the file's noise."""
    simulator = Simulator(KESTREL, 400.0)
    plan = parse_manoeuvre(("3211:repeat=3",), KESTREL, simulator.rate, None)
    moves = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    flown = SortieConditions([f"actuator_lag:time_constant={LATE}"], seed=seed, noise=noise, command_rate=100.0)
    streams = FlightSampler(200.0, 100.0, 100.0, surfaces="commanded").record(fly_sortie(simulator, moves, flown))
    belief = replace(KESTREL, noise={name: noise * sigma for name, sigma in KESTREL.noise.items()})
    settings = OnlineSettings(method=method)
    aligned = align_streams(belief, streams, settings.max_gap, "commands")
    return run(belief, settings, aligned.time, aligned.samples, aligned.time[-1:], commands_from=0)[-1]


@pytest.mark.slow
def test_with_little_noise_servos_and_derivatives_are_those_flown() -> None:
    """Without tolerances in the way of it: the estimates themselves, in shares of the truth."""
    found = estimated(0.1, "iv_rft", 1)
    for servo in found.servos.values():
        assert servo.value == pytest.approx(LATE, abs=0.012)
    for name in ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da"):
        truth = KESTREL.derivatives[name].value
        assert found.derivatives[name].value == pytest.approx(truth, rel=0.15), name


@pytest.mark.slow
def test_a_flight_does_not_tell_how_late_the_imu_is() -> None:
    """A late IMU is the same as early air data and faster servos, of which the file says little.

    Truth: the tolerance's standard deviation, of a normal distribution cut off below zero. The airspeed changes by a
    fifth, and what it multiplies must not seem to tell more, however little noise there is.
    """
    budget = estimated(0.1, "iv_rft", 1).budget
    assert isinstance(budget, Budget)
    place = budget.sources.index("delays.imu")
    believed = KESTREL.tolerances["delays.imu"] * math.sqrt(1.0 - 2.0 / math.pi)
    assert math.sqrt(budget.covariance[place, place]) == pytest.approx(believed, rel=0.1)


@pytest.mark.slow
def test_with_the_usual_noise_intervals_hold() -> None:
    """By the default method. Least squares takes the autopilot's answers to the vanes' noise for manoeuvres.

    Of 22 errors at most one is beyond the 99 % of a normal distribution (more in one of 55 sets), and none beyond 3.5.
    """
    scores = []
    for seed in (1, 2):
        found = estimated(1.0, "iv_rft", seed)
        scores += [(servo.value - LATE) / servo.standard_error for servo in found.servos.values()]
        for name in ("CL_alpha", "CL_de", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_dr"):
            d, truth = found.derivatives[name], KESTREL.derivatives[name].value
            scores.append((d.value - truth) / d.standard_error)
    errors = np.sort(np.abs(scores))
    assert errors[-2] < 2.6
    assert errors[-1] < 3.5


@pytest.mark.slow
def test_the_form_of_a_response_does_not_tell_late_servos_from_late_stamps() -> None:
    """Servos of second order without a delay, in still air, of which the file says nothing.

    Truth: the tolerances of the clocks of controls and IMU, of which a flight shows the sum with the servos' lateness.
    Where what is expected of a servo's form was held fixed while its lateness changed, the elevator's was 4.9 ms.
    """
    aircraft = load_aircraft("cdfp")
    simulator = Simulator(aircraft, 400.0)
    plan = parse_manoeuvre(("multisine:every=22:repeat=2",), aircraft, simulator.rate, None)
    moves = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    flown = SortieConditions(["actuator_lag:time_constant=0.03:damping=0.7"], seed=5, command_rate=100.0)
    streams = FlightSampler(200.0, 100.0, 100.0, surfaces="commanded").record(fly_sortie(simulator, moves, flown))
    aligned = align_streams(aircraft, streams, OnlineSettings().max_gap, "commands")
    found = run(aircraft, OnlineSettings(), aligned.time, aligned.samples, aligned.time[-1:], commands_from=0)[-1]
    imu = aircraft.tolerances["delays.imu"] * math.sqrt(1.0 - 2.0 / math.pi)  # of what is never early
    clocks = math.hypot(aircraft.tolerances["delays.actuators"], imu)
    for name, servo in found.servos.items():
        assert servo.standard_error > 0.8 * clocks, name
        assert abs(servo.value - 0.042) < 3.0 * servo.standard_error, name
