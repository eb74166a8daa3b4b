"""Servos of which nothing is known, where the fit has two minima.

Truth: the bundled flights' measured positions, taken for commands, and simulated flights with positions. They move the
surfaces at once, so no servo is late. In one flight commands are recorded, and the servos' times are those flown.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.estimation.no_vanes import ANGLES, drawn
from bench.estimation.simulated_flights import Setting, fly
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.streams import COMMANDS
from sysid_node.flight.truth import read_truth
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie

LAGS, DAMPING, DELAY = {"elevator": 0.049, "aileron": 0.057, "rudder": 0.069}, 0.64, 0.025  # s, 1, s: of second order
BAGS = Path(__file__).resolve().parents[3] / "bags"


@pytest.mark.slow
@pytest.mark.parametrize(("bag", "control"), [("cdfp_multistep", "aileron"), ("cdrw_random", "elevator")])
def test_a_servo_and_a_mode_of_the_aircraft_do_not_exchange_their_times(bag: str, control: str):
    """Gauss-Newton steps alone end where the control is 70 to 100 ms late, and its derivatives are far off."""
    aircraft, streams = load_aircraft(bag[:4]), read_streams(BAGS / bag)
    streams = replace(streams, actuators=replace(streams.actuators, content=COMMANDS))
    settings = OnlineSettings()
    aligned = align_streams(aircraft, streams, settings.max_gap, "commands")
    end = aligned.time[-1:]
    found = run(aircraft, settings, aligned.time, aligned.samples, end, commands_from=aligned.commands_from)[-1]
    servo, truth = found.servos[control], read_truth(BAGS / bag)
    assert abs(servo.value) < 2.0 * servo.standard_error < 0.03
    for name in ("Cl_p", "Cl_da", "Cm_de"):
        estimate = found.derivatives[name]
        assert estimate.lower < truth[name] < estimate.upper
        assert estimate.standard_error < 0.2 * abs(truth[name])


@pytest.mark.slow
def test_deflections_that_may_be_positions_or_commands_are_no_late_commands() -> None:
    """Steps alone end where the elevator is 55 +- 6 ms late, and its moment and the damping have the other sign."""
    aircraft, seed = load_aircraft("kestrel"), 4
    batch = fly("kestrel", Setting("two minima", "light", autopilot=False, seconds=60.0), [seed])
    found = run(aircraft, OnlineSettings(), batch.time, batch.samples[0], batch.time[-1:])[-1]
    servo = found.servos["elevator"]
    assert servo.lower < 0.0 < servo.upper
    for name in ("Cm_q", "Cm_de"):
        estimate = found.derivatives[name]
        assert estimate.lower < aircraft.derivatives[name].value < estimate.upper


@pytest.mark.slow
@pytest.mark.parametrize("seed", [30, 47])
def test_a_servo_is_not_so_late_that_the_roll_would_amplify_itself(seed: int) -> None:
    """Steps alone end where the aileron is 100 +- 10 ms late; then ``Cl_p`` is 6.5 standard errors off, and positive.

    A file that is off within its tolerances, light turbulence and no vanes leave this minimum as deep as the right one.
    In the first flight a prompt aileron is tried from 40 ms, in the second from 100 ms.
    """
    batch = fly("cdrw", Setting("light turbulence", "light", autopilot=False), [seed])
    batch.samples[..., ANGLES] = np.nan
    found = run(drawn(load_aircraft("cdrw"), seed), OnlineSettings(), batch.time, batch.samples[0], batch.time[-1:])[-1]
    truth = load_aircraft("cdrw").derivatives
    assert found.servos["aileron"].value < 0.08
    for name in ("Cl_beta", "Cl_p", "Cl_da"):
        assert found.derivatives[name].lower < truth[name].value < found.derivatives[name].upper


@pytest.mark.slow
@pytest.mark.parametrize("surfaces", ["commanded", "measured"])
def test_stated_servos_may_come_after_smooth_messages_or_not(surfaces: str) -> None:
    """Steps alone end where the aileron is 28 ms early, and ``Cl_p`` is four standard errors off."""
    aircraft = load_aircraft("kestrel")
    simulator = Simulator(aircraft, 1000.0)
    plan = parse_manoeuvre("multisine:every=22:repeat=2", aircraft, simulator.rate)
    moves = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    lags = {name: lag / (2.0 * DAMPING) for name, lag in LAGS.items()}
    servos = {"actuator_lag": lags | {"damping": DAMPING}, "command_delay": dict.fromkeys(LAGS, DELAY)}
    sortie = fly_sortie(simulator, moves, SortieConditions(servos, seed=9281, command_rate=100.0))
    streams = FlightSampler(surfaces=surfaces).record(sortie)
    stated = {effect: {k: UncertainValue(v, 0.2 * v) for k, v in sizes.items()} for effect, sizes in servos.items()}
    aircraft = replace(aircraft, effects=stated)
    settings = OnlineSettings()
    aligned = align_streams(aircraft, streams, settings.max_gap, "auto")
    assert aligned.commands_from == aligned.time.size  # smooth messages do not show what they are
    found = run(aircraft, settings, aligned.time, aligned.samples, aligned.time[-1:])[-1]
    for name, servo in found.servos.items():
        late = LAGS[name] + DELAY if surfaces == "commanded" else 0.0
        assert abs(servo.value - late) < 2.6 * servo.standard_error < 0.03, name
    for name in ("Cl_p", "Cl_da", "Cm_q", "Cm_de"):
        estimate, truth = found.derivatives[name], aircraft.derivatives[name].value
        assert abs(estimate.value - truth) < 2.6 * estimate.standard_error, name
