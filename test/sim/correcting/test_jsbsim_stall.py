"""Flow separation in JSBSim's c172p. Truth: Kirchhoff's law of stall, and its memory, written here anew."""

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from corrected_model import POUND, added_load, having, loads_of, running

from sysid_node.sim.correcting.jsbsim_model import write_corrected

STALL = {"depth": 0.8, "alpha_star": 0.22, "a1": 15.0, "tau1": 12.0, "tau2": 4.0, "CD_X": 0.12, "Cm_X": -0.06}
X = "fcs/corrected/attached"


def steady(alpha, alpha_rate=0.0, scale=0.0):
    return 0.5 * (1.0 - math.tanh(15.0 * (alpha - 4.0 * scale * alpha_rate - 0.22)))


@pytest.fixture(scope="module")
def program(survey, file, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stall")
    corrected = write_corrected(survey, file, having(file, stall_separation=STALL), folder / "corrected")
    assert not corrected.left_out
    return running(corrected.files, folder / "run")


@pytest.mark.parametrize("alpha", [0.05, 0.15, 0.2, 0.3])
def test_loads_of_separated_flow(survey, file, program, alpha):
    """At rest in a state: lift times depth (1 - ((1 + sqrt X) / 2)^2) is lost, drag and pitching moment are added."""
    state = replace(survey.steady.state, alpha=alpha)
    program.put(state, {})
    program.step(4000)
    fdm = program.fdm
    scale = file.geometry.cbar / state.airspeed
    attached = steady(alpha, float(fdm["aero/alphadot-rad_sec"]), scale)
    assert fdm[X] == pytest.approx(attached, abs=1e-4)
    added, density = added_load(program)
    pressure = 0.5 * density * state.airspeed**2 * file.geometry.S
    lift = fdm["forces/fwz-aero-lbs"] * POUND / pressure
    half = 0.5 * (1.0 + math.sqrt(fdm[X]))
    lost = 1.0 - fdm[X]
    expected = {"CL": -0.8 * lift * (1.0 - half * half), "CD": 0.8 * 0.12 * lost, "Cm": 0.8 * -0.06 * lost}
    assert added == pytest.approx(loads_of(expected, alpha, pressure, file.geometry), abs=1e-3 * pressure)


def test_the_flow_has_a_memory(survey, file, tmp_path):
    """After a step of alpha X approaches its new value with tau1 cbar / V; without tau2 the rate of alpha is none."""
    after = having(file, stall_separation={**STALL, "tau2": 0.0})
    program = running(write_corrected(survey, file, after, tmp_path / "corrected").files, tmp_path / "run")
    state = survey.steady.state
    program.put(replace(state, alpha=0.05), {})
    program.step(4000)
    program.put(replace(state, alpha=0.3), {})
    program.suspend()
    rows = []
    for _ in range(400):
        program.fdm.run()
        rows.append(float(program.fdm[X]))
    program.resume()
    decay = np.exp(-np.arange(400) / 400.0 * state.airspeed / (12.0 * file.geometry.cbar))
    expected = steady(0.3) + (rows[0] - steady(0.3)) * decay
    assert rows[0] > 0.95
    assert rows == pytest.approx(expected.tolist(), abs=1e-4)
