"""Servos of which the aircraft file is silent, where the fit has two minima.

Truth: the bundled flights' measured positions, taken for commands, and simulated flights with positions. They move the
surfaces at once, so no servo is late.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bench.estimation.simulated_flights import Setting, fly
from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.streams import COMMANDS
from sysid_node.flight.truth import read_truth
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings

BAGS = Path(__file__).resolve().parents[3] / "bags"


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
