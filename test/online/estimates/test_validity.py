"""What an estimate is called. Truth: the derivatives that the flight was simulated with."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from plant import TRUTH, fly, made_aircraft, multisteps

from bench.estimation.all_imperfections import RATE as SIMULATED_RATE
from bench.estimation.all_imperfections import drawn, known
from bench.estimation.all_imperfections import estimated as identified
from bench.estimation.all_imperfections import fly as fly_at_the_hands_of_an_autopilot
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.cli.main import main
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.streams import COMMANDS
from sysid_node.online import estimator
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.estimates.published import estimate
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS, Estimates
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler

RATE, SECONDS, LATE = 100.0, 40.0, 2  # Hz, s, samples
EXACT, ELEVATOR = made_aircraft(), len(SAMPLE_COLUMNS)


@cache
def estimated(samples_late: int) -> Estimates:
    """Of one flight, whose elevator was felt so many samples after its recorded deflection."""
    time, (samples,) = fly(EXACT, multisteps(SECONDS, RATE), RATE)
    samples[:, ELEVATOR] = np.roll(samples[:, ELEVATOR], -samples_late)
    state = estimator.init(EXACT, OnlineSettings(method="sls_rft", actuators="positions"))
    for at, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, at, sample)
    return estimate(state)


def test_a_surface_that_the_pitching_moment_feels_late_is_late_for_lift_and_drag() -> None:
    found = estimated(LATE).derivatives
    for name in ("Cm_alpha", "CL_alpha", "CL_de", "CD_alpha", "CD_0"):
        assert found[name].status == "de not on time", name


def test_a_late_elevator_says_nothing_of_roll_and_yaw() -> None:
    found = estimated(LATE).derivatives
    assert all(found[name].valid for name in ("CY_beta", "Cl_p", "Cl_da", "Cn_r", "Cn_dr"))


def test_what_is_valid_is_near_the_truth() -> None:
    for late in (0, LATE):
        found = estimated(late).derivatives
        valid = {name: d for name, d in found.items() if d.valid and name in TRUTH}
        assert len(valid) >= (12 if late else 20)
        for name, d in valid.items():
            assert abs(d.value - TRUTH[name]) < 4.0 * d.standard_error, name


@cache
def in_gusts(moved: bool, stated_noise: float) -> Estimates:
    """Of a flight in gusts under an autopilot; the file states so many times the sensors' noise."""
    commands = multisteps(SECONDS, RATE) if moved else np.zeros((int(SECONDS * RATE), 3))
    time, (samples,) = fly(EXACT, commands, RATE, gusts=1.5)
    known = replace(EXACT, noise={name: stated_noise * sigma for name, sigma in EXACT.noise.items()})
    settings = OnlineSettings(method="sls_rft", actuators="positions", detect_changes=False)
    state = estimator.init(known, settings)
    for at, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, at, sample)
    return estimate(state)


def test_surfaces_that_do_nothing_but_answer_gusts_tell_nothing_where_more_than_sensor_noise_is_left() -> None:
    found = in_gusts(moved=False, stated_noise=0.3).derivatives
    assert {d.status for d in found.values()} == {"surfaces answer gusts"}


def test_surfaces_that_are_moved_on_purpose_as_well_tell_the_derivatives() -> None:
    found = in_gusts(moved=True, stated_noise=0.3).derivatives
    assert "surfaces answer gusts" not in {d.status for d in found.values()}
    assert all(found[name].valid for name in ("CL_alpha", "Cm_alpha", "Cm_de", "Cl_p", "Cn_dr"))


def test_answers_to_gusts_that_vanes_measure_do_no_harm() -> None:
    found = in_gusts(moved=False, stated_noise=1.0).derivatives
    assert all(found[name].valid for name in ("CL_alpha", "Cm_alpha", "Cm_de"))


@pytest.mark.slow
def test_slopes_that_a_poorly_known_servo_changes_by_much_are_not_valid() -> None:
    """A minute in moderate turbulence; the file is silent on servos of 90 ms, and on all else that is a little off.

    The aileron's time is half of what it is, and ``Cl_p`` and ``Cl_da`` were 4.2 and 4.9 standard errors off.
    """
    aircraft, number = load_aircraft("cdfp"), 9158
    kind, effects = drawn(aircraft, number)
    sortie = fly_at_the_hands_of_an_autopilot(Simulator(aircraft, SIMULATED_RATE), effects, kind["air"], number)
    file = known(aircraft, kind, effects, number)
    derivatives, servos = identified("replay", file, FlightSampler().record(sortie), "commands")
    assert servos["aileron"].standard_error > 0.02
    assert servos["rudder"].standard_error < 0.02
    for name in ("Cl_p", "Cl_da", "Cm_alpha"):
        assert not derivatives[name].valid, name
        assert derivatives[name].status == "converging", name
    for name in ("CY_beta", "CY_dr", "Cn_beta", "Cn_dr"):
        found = derivatives[name]
        assert found.valid, name
        assert abs(found.value - sortie.derivatives[name]) < 3.0 * found.standard_error, name


@pytest.mark.slow
def test_nothing_of_an_axis_is_valid_whose_motion_would_amplify_itself() -> None:
    """Truth: measured positions, taken for commands of a servo of 0.2 s: the roll comes before its cause.

    ``Cl_p``, ``Cl_da`` and ``Cl_beta`` had the other sign and were ``ok``.
    """
    bag = Path(__file__).parents[3] / "bags" / "cdrw_multistep"
    file = replace(load_aircraft("cdrw"), effects={"actuator_lag": {"aileron": UncertainValue(0.2, 0.001)}})
    streams, settings = read_streams(bag), OnlineSettings()
    streams = replace(streams, actuators=replace(streams.actuators, content=COMMANDS))
    aligned = align_streams(file, streams, settings.max_gap, "commands")
    found = run(file, settings, aligned.time, aligned.samples, aligned.time[-1:], commands_from=aligned.commands_from)
    derivatives = found[-1].derivatives
    assert derivatives["Cl_p"].value > 5.0 * derivatives["Cl_p"].standard_error
    for name in ("Cl_p", "Cl_da", "Cl_beta", "CY_beta", "Cn_beta", "Cn_dr"):
        assert derivatives[name].status == "da not on time", name
    assert derivatives["Cm_alpha"].valid and derivatives["Cm_de"].valid


@pytest.mark.slow
def test_the_time_of_a_servo_whose_control_may_have_no_effect_is_not_valid(tmp_path: Path) -> None:
    """Light turbulence under the loops of PX4, held commands and no lag: 0.097 +- 0.007 s for the elevator was valid.

    The pitching moment's derivatives are hardly known there: the autopilot's answers to gusts hide the manoeuvre.
    """
    words = ["--loops", "px4", "--turbulence", "light", "--seed", "5", "--quiet", "--out", str(tmp_path / "bag")]
    assert main(["simulate", "--aircraft", "cdrw", "--manoeuvre", "3211:repeat=3", *words]) == 0
    streams = read_streams(tmp_path / "bag")
    derivatives, servos = identified("replay", load_aircraft("cdrw"), streams, "auto")
    assert abs(derivatives["Cm_de"].value) < 1.96 * derivatives["Cm_de"].standard_error
    assert servos["elevator"].status == "converging"
    assert not servos["elevator"].valid
    assert servos["rudder"].valid
    assert servos["rudder"].lower < 0.0 < servos["rudder"].upper
