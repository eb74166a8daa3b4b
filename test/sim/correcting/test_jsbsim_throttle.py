"""Lag and delay of the thrust in JSBSim models. Truth: a lag of first order behind a delay, on the engine's lever."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from corrected_model import having, running

from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim.correcting.jsbsim_model import write_corrected
from sysid_node.sim.export.jsbsim import jsbsim_model
from sysid_node.sim.importing.jsbsim.survey import survey_model

LEVER = "fcs/throttle-pos-norm"


def test_the_lever_lags_behind_the_throttle(survey, file, tmp_path):
    """A step of the throttle by 0.2: the engine's lever follows with 0.3 s after 0.1 s."""
    after = having(file, motor_lag={"time_constant": 0.3}, command_delay={"throttle": 0.1})
    corrected = write_corrected(survey, file, after, tmp_path / "corrected")
    assert not corrected.left_out
    program = running(corrected.files, tmp_path / "run")
    program.put(replace(survey.steady.state, throttle=0.5), {})
    program.step(1200)
    program.suspend()
    program.fdm["fcs/throttle-cmd-norm"] = 0.7
    rows = []
    for _ in range(400):
        program.fdm.run()
        rows.append(float(program.fdm[LEVER]))
    time = np.arange(1, 401) / 400.0 - 0.1
    expected = 0.5 + 0.2 * (1.0 - np.exp(-np.maximum(time, 0.0) / 0.3))
    np.testing.assert_allclose(rows, expected, atol=2e-3)


@pytest.mark.parametrize(
    ("before", "after", "effect", "why"),
    [
        ({"motor_lag": {"time_constant": 0.3}}, {"motor_lag": {"time_constant": 0.1}}, "motor_lag", "quicker"),
        (
            {"command_delay": {"throttle": 0.2}},
            {"command_delay": {"throttle": 0.1}},
            "command_delay of the throttle",
            "quicker",
        ),
    ],
)
def test_a_model_that_would_have_to_be_quicker_is_left_as_it_is(survey, file, tmp_path, before, after, effect, why):
    known = having(file, **before)
    corrected = write_corrected(survey, known, having(file, **after), tmp_path)
    assert corrected.left_out == {effect: f"the model itself would have to be {why}"}


def test_a_throttle_of_the_models_own_control_system_is_left_to_it(survey, file, tmp_path):
    """A component of the model that writes the lever already."""
    own = write_corrected(survey, file, having(file, motor_lag={"time_constant": 0.2}), tmp_path / "own")
    again = survey_model(str(own.files.main), 52.0, 900.0)
    assert again.lever_times == pytest.approx((0.2, 0.0))  # and the steady flight is found without it
    known = having(file, motor_lag={"time_constant": 0.2})
    slower = write_corrected(again, known, having(file, motor_lag={"time_constant": 0.4}), tmp_path / "slower")
    assert slower.left_out == {"motor_lag": "the model's own flight control system moves the throttle"}


def test_a_model_without_engine_has_no_lever(tmp_path):
    """An exported model's thrust is an external force."""
    kestrel = load_aircraft("kestrel")
    path = tmp_path / "kestrel.xml"
    path.write_text(jsbsim_model(kestrel))
    survey = survey_model(str(path), 16.0, 0.0)
    corrected = write_corrected(survey, kestrel, having(kestrel, motor_lag={"time_constant": 0.2}), tmp_path / "out")
    assert corrected.left_out == {"motor_lag": "the model has no engine with a lever"}
