"""Short flights in JSBSim itself, of an exported aircraft. Truth: this package's simulator of the same aircraft."""

from dataclasses import replace

import numpy as np
import pytest
from plain import steps

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Control, Sensors
from sysid_node.dynamics.attitude import euler_angles
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.correcting.jsbsim_flight import JsbsimFlyer
from sysid_node.sim.export.jsbsim import jsbsim_model
from sysid_node.sim.importing.jsbsim.survey import survey_model

RATE, SECONDS = 100.0, 6.0

EFFECTS = {"actuator_lag": {"elevator": 0.05, "aileron": 0.03, "rudder": 0.04}, "drag_rise": {"parabola": 0.1}}


#: JSBSim's frames a second, and the largest difference that they leave, as a share of a signal's range.
FRAMES = {400.0: 0.02, 3200.0: 0.01}


@pytest.fixture(scope="module", params=FRAMES)
def flown(request, tmp_path_factory):
    """States, specific forces and those of JSBSim: steps on all surfaces, begun from trim and anew every 2 s."""
    kestrel = replace(load_aircraft("kestrel"), sensors=Sensors())
    path = tmp_path_factory.mktemp("flyer") / "kestrel.xml"
    path.write_text(jsbsim_model(kestrel, EFFECTS))
    simulator = Simulator(kestrel, RATE)
    theta = simulator.vector(EFFECTS)
    trim = trim_flight(simulator, theta=theta)
    time = np.arange(round(SECONDS * RATE)) / RATE
    moves = [steps(time, 0.3, 0.04, 0.2), steps(time, 2.2, 0.05, 0.2), steps(time, 4.2, 0.06, 0.2), 1.0 * (time > 3.0)]
    commands = trim.command + np.column_stack(moves)
    ours = simulator.rollout(theta, trim.initial, simulator.inputs(commands))
    survey = survey_model(str(path), 16.0, -trim.initial[2])
    flyer = JsbsimFlyer(survey, survey.files, kestrel, RATE, request.param)
    states = np.asarray(ours.states)[:, :13]
    begins = np.arange(len(time)) % 200 == 0
    found = flyer.fly_short(begins, states, commands, np.zeros((len(time), 3)), RATE)
    return states, np.asarray(ours.outputs), found, begins, FRAMES[request.param]


def share(theirs, ours):
    """The largest difference of each signal as a share of its range."""
    return np.abs(theirs - ours).max(axis=0) / np.ptp(ours, axis=0)


@pytest.mark.slow
def test_short_flights_are_those_of_our_simulator(flown):
    """Rates, velocity, attitude and specific force within 2 % of their ranges; with 8 times the frames, within 1 %.

    The difference is that of JSBSim's frames of 2.5 ms: it applies a frame's surfaces one frame later and integrates by
    lower orders. What more frames leave is mostly in the forward speed: its earth turns, and its gravity falls off.
    """
    states, outputs, found, _, allowed = flown
    assert np.isfinite(found.rates).all()
    assert (share(found.rates, states[:, 10:13]) < allowed).all()
    assert (share(found.velocity, states[:, 3:6]) < allowed).all()
    attitude = np.column_stack(euler_angles(tuple(states[:, 6:10].T), np))
    assert (share(found.attitude[:, :2], attitude[:, :2]) < allowed).all()
    assert (share(found.force, outputs[:, :3]) < allowed).all()


@pytest.mark.slow
def test_short_flights_begin_in_the_given_state(flown):
    states, _, found, begins, _ = flown
    assert found.velocity[begins] == pytest.approx(states[begins, 3:6], abs=0.02)
    assert found.rates[begins] == pytest.approx(states[begins, 10:13], abs=0.005)


def test_a_tail_that_two_controls_move_is_set_to_both():
    """JSBSim's f16: its elevator is moved by the aileron command, too. Truth: the sum of what each adds to its rest."""
    survey = survey_model("f16", 150.0)
    symbols = {"elevator": "de", "aileron": "da", "rudder": "dr"}
    controls = {s.name: Control(s.name, symbols[s.name], {s.name: s.sign}) for s in survey.surfaces}
    aircraft = replace(load_aircraft("kestrel"), controls=controls, effects={})
    flyer = JsbsimFlyer(survey, survey.files, aircraft, RATE)
    command = {"elevator": -0.1, "aileron": 0.05, "rudder": 0.02}
    commands = np.tile([*command.values(), 0.0], (3, 1))
    states = np.zeros((3, 13))
    states[:, 2], states[:, 3], states[:, 5], states[:, 6] = -1000.0, 150.0, 5.0, 1.0
    flyer.fly_short(np.array([True, False, False]), states, commands, np.zeros((3, 3)), RATE)
    elevator, aileron = (s for s in survey.surfaces if s.name != "rudder")
    tail, place = elevator.position, aileron.command_for(0.0)
    order = np.argsort(aileron.command)
    still = np.interp(place, aileron.command[order], aileron.properties[tail][order])
    alone, added = elevator.at(-0.1)[tail], aileron.at(0.05)[tail] - still
    assert abs(added) > 1e-3
    assert float(flyer.program.fdm[tail]) == pytest.approx(alone + added, abs=1e-6)
