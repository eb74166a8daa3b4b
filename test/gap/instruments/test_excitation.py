"""Whose doing the commands are: the pilot's, a programme's, or an autopilot's against gusts; truth: what was flown."""

import pytest

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.instruments.excitation import driven_by_gusts, external_excitation, externally_excited
from sysid_node.gap.instruments.liml import liml_estimate
from sysid_node.gap.instruments.overidentification import overidentification_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.sim import Simulator

MULTISINE = ["multisine:elevator,aileron,rudder:amplitude=0.06,0.06,0.1:length=24:low=0.1:high=2.5:start=1"]


@pytest.fixture(scope="module")
def seen(aircraft, make_flight):
    """A flight of some manoeuvre in light turbulence, derivatives off."""
    simulator, wrong = Simulator(aircraft, 50.0), {"derivative_error": {"Cm_alpha": 0.015, "Cl_p": 0.03}}
    return lambda manoeuvre: residual_model_of(
        simulator, make_flight(wrong, seed=5, turbulence="light", manoeuvre=manoeuvre, duration=29.0)
    )


def test_an_autopilot_alone_in_gusts_tells_nothing(seen) -> None:
    model = seen([])
    assert driven_by_gusts(model) and not externally_excited(model)
    assert external_excitation(model).all.shape[1] == 0


def test_a_flight_that_tells_nothing_is_judged_all_the_same(seen) -> None:
    model = seen([])
    fit = converged(unfitted([model], nuisances_of(model.simulator.aircraft, model)), rounds=1)
    left = overidentification_of(liml_estimate(fit))
    assert not left.coherent.any()


def test_steps_are_deliberate_though_the_autopilot_flies_too(seen) -> None:
    model = seen(None)
    assert externally_excited(model) and external_excitation(model).steps.shape[1] >= 3


@pytest.mark.slow
def test_a_multisine_is_no_answer_to_gusts(seen) -> None:
    model = seen(MULTISINE)
    assert not driven_by_gusts(model) and external_excitation(model).all.shape[1] >= 3


def test_in_still_air_there_is_no_weather(plain_model) -> None:
    assert not driven_by_gusts(plain_model) and externally_excited(plain_model)
