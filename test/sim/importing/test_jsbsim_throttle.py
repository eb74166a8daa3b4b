"""Thrust over throttle and airspeed, and the engine's lag, of an imported JSBSim model. Truth: JSBSim's own engine."""

from dataclasses import replace

import numpy as np
import pytest
from aircraft_loads import loads

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from sysid_node.sim import Simulator
from sysid_node.sim.importing.jsbsim.files import copy_model
from sysid_node.sim.importing.jsbsim.program import Program
from sysid_node.sim.importing.jsbsim.read import read_jsbsim, read_model


@pytest.fixture(scope="module", params=["T37", "c172p"])
def model(request):
    return request.getfixturevalue("cessna") if request.param == "c172p" else read_model("T37", 77.0, 900.0)


@pytest.mark.slow
def test_forces_follow_the_throttle_and_the_airspeed_as_in_jsbsim(model, tmp_path):
    """Force along x at throttles between the tables' points: within 2 % of its range; 10 % and more without tables."""
    aircraft, state = model.imported.aircraft, model.steady.state
    program = Program(copy_model(model.files, tmp_path, {p for s in model.surfaces for p in s.properties}))
    driven = {k: v for s in model.surfaces for k, v in s.at(model.steady.deflections[s.name]).items()}
    throttles, speeds = np.meshgrid([0.25, 0.45, 0.65, 0.78, 0.95], state.airspeed * np.array([0.88, 1.0, 1.12]))
    x = {n: np.zeros(throttles.size) for n in ("beta", "p", "q", "r")} | {"alpha": np.full(throttles.size, state.alpha)}
    x |= {"throttle": throttles.ravel(), "V": speeds.ravel()}
    x |= {c.symbol: np.full(throttles.size, model.steady.deflections[n]) for n, c in aircraft.controls.items()}
    there = []
    for throttle, airspeed in zip(x["throttle"].tolist(), x["V"].tolist(), strict=True):
        program.put(replace(state, airspeed=airspeed, throttle=throttle), driven)
        found = program.loads()
        there.append(found.air[0] + found.engine[0])
    proportional = replace(aircraft, tables=tuple(t for t in aircraft.tables if "throttle" not in t.over))
    full, range_ = aircraft.throttle.max_thrust, np.ptp(there)
    here, without = (loads(a, x, full * x["throttle"])[:, 0] for a in (aircraft, proportional))
    assert np.abs(here - there).max() < 0.02 * range_
    assert np.abs(without - there).max() > 0.1 * range_


def test_thrust_lags_the_throttle_as_the_engine_does(model, tmp_path):
    """After delay and lag the engine has done 55 to 75 % (1 - 1/e: 63 %) of what a step of 0.04 does in six seconds."""
    effects = model.imported.aircraft.effect_values()
    lag = effects["motor_lag"]["time_constant"] + effects.get("command_delay", {}).get("throttle", 0.0)
    program = Program(copy_model(model.files, tmp_path, {p for s in model.surfaces for p in s.properties}))
    flown = []
    for step in (0.0, 0.04):
        program.put(model.steady.state, {})
        program.run_for(0.2)
        program.levers(model.steady.state.throttle + step)
        program.run_for(lag)
        early = program.loads().engine[0]
        program.run_for(6.0 - lag)
        flown.append((early, program.loads().engine[0]))
    early, late = np.diff(flown, axis=0)[0]
    assert 0.55 < early / late < 0.75


@pytest.mark.slow
def test_an_engine_that_is_later_than_a_file_can_state_is_imported_as_a_file_that_can_be_flown():
    """Camel's answers a step of the throttle 0.9 s late; with the longest delay, its lag is as much longer."""
    imported = read_jsbsim("Camel")
    effects = imported.aircraft.effect_values()
    assert effects["command_delay"]["throttle"] == 0.5
    assert effects["motor_lag"]["time_constant"] + 0.5 == pytest.approx(3.34, abs=0.1)
    Simulator(imported.aircraft, 50.0).vector({})
