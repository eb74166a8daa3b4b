"""Servos written into JSBSim's c172p. Truth: positions by the equations of play, offset and lags, written here anew."""

import math

import numpy as np
import pytest

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from corrected_model import having, running

from sysid_node.sim.correcting.jsbsim_model import write_corrected
from sysid_node.sim.importing.jsbsim.surfaces import COMMANDS
from sysid_node.sim.importing.jsbsim.survey import survey_model

RATE = 400.0


def positions(survey, files, folder, commands):
    """Positions (N, 3) of elevator, aileron and rudder (rad) at rest on zero, then with commands (N,) in rad on all."""
    program = running(files, folder)
    surfaces = {s.name: s for s in survey.surfaces}
    zero = {COMMANDS[name]: s.command_for(0.0) for name, s in surfaces.items()}
    program.put(survey.steady.state, zero)
    program.step(1600)
    program.suspend()
    rows = []
    for command in commands:
        program.drive({COMMANDS[name]: surfaces[name].command_for(float(command)) for name in COMMANDS})
        program.fdm.run()
        rows.append([surfaces[n].sign * surfaces[n].unit * float(program.fdm[surfaces[n].position]) for n in COMMANDS])
    return np.array(rows)


def play(commands, width, start):
    """A surface that its actuator drags along at either end of the free play."""
    x, rows = start, []
    for u in commands:
        x = max(x, u - 0.5 * width) if u > x else min(x, u + 0.5 * width)
        rows.append(x)
    return np.array(rows)


def test_free_play_and_offsets(survey, file, tmp_path):
    """A slow sine of 0.1 rad: 0.02, 0.03 and 0.04 rad of play; the rudder stands 0.01 rad off as well."""
    after = having(file, actuator_backlash={"elevator": 0.02, "aileron": 0.03, "rudder": 0.04},
                   actuator_bias={"rudder": 0.01})  # fmt: skip
    corrected = write_corrected(survey, file, after, tmp_path / "corrected")
    assert not corrected.left_out
    commands = 0.1 * np.sin(2.0 * math.pi * np.arange(1200) / 400.0)
    found = positions(survey, corrected.files, tmp_path / "run", commands)
    settled = slice(400, None)  # where the surface rested within its play does not matter any more
    for k, (width, offset) in enumerate(((0.02, 0.0), (0.03, 0.0), (0.04, 0.01))):
        expected = play(commands, width, 0.0) + offset
        np.testing.assert_allclose(found[settled, k], expected[settled], atol=1e-4)


@pytest.mark.parametrize("damping", [0.5, 1.0, 1.6])
def test_servos_of_second_order(survey, file, tmp_path, damping):
    """A step's answer of T^2 x'' + 2 damping T x' + x = u by its poles."""
    times = {"elevator": 0.03, "aileron": 0.04, "rudder": 0.05}
    after = having(file, actuator_lag={**times, "damping": damping})
    corrected = write_corrected(survey, file, after, tmp_path / "corrected")
    assert not corrected.left_out
    found = positions(survey, corrected.files, tmp_path / "run", np.full(200, 0.1))
    time = (np.arange(200) + 0.5) / RATE  # JSBSim's bilinear rule takes a step for one in the middle of a frame
    for k, T in enumerate(times.values()):
        z = damping + 1e-6 * (damping == 1.0)
        root = np.sqrt(complex(z * z - 1.0))
        a, b = (-z + root) / T, (-z - root) / T
        expected = 0.1 * (1.0 + ((b * np.exp(a * time) - a * np.exp(b * time)) / (a - b)).real)
        np.testing.assert_allclose(found[:, k], expected, atol=1e-3)
    again = survey_model(str(corrected.files.main), 52.0, 900.0)
    assert {n: s.lag for n, s in again.servos.items()} == pytest.approx(times)
    assert [s.damping for s in again.servos.values()] == pytest.approx([damping] * 3)


def test_a_servo_of_a_surface_that_moves_with_the_motion_is_left_as_it_is(file, tmp_path):
    """JSBSim's 737 has a yaw damper: its rudder's position depends on the motion."""
    survey = survey_model("737", 130.0, 3000.0)
    assert any(s.feedback for s in survey.surfaces)
    from corrected_model import file_of  # noqa: PLC0415

    own = file_of(survey)
    name = next(s.name for s in survey.surfaces if s.feedback)
    corrected = write_corrected(survey, own, having(own, actuator_lag={name: 0.1}), tmp_path)
    assert corrected.left_out == {f"servo of {name}": "its position depends on the motion in this model"}
