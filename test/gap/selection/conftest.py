"""What the tests of selection share: a flight with an effect of the actuators, and what may be blamed for it."""

from collections.abc import Mapping

import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.candidates import SECOND_ORDER, Candidate, candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.sim import Simulator

Fitted = tuple[CandidateFitter, FittedSet, dict[str, Candidate]]


@pytest.fixture(scope="module")
def late(aircraft) -> Fitted:
    """A flight with commands 0.1 s late: its fitter, nuisances alone, and some candidates by label."""
    wanted = ("command_delay", "actuator_lag", "thrust_scale", "stuck_surface of elevator", "inertia_error")
    return _fitted(aircraft, {"command_delay": {"delay": 0.1}}, 14, wanted)


@pytest.fixture(scope="module")
def oscillating(aircraft) -> Fitted:
    """As ``late``, with servos of second order: 0.06 s and a damping of 0.7."""
    effect = {"actuator_lag": {"time_constant": 0.06, "damping": 0.7}}
    return _fitted(aircraft, effect, 15, ("command_delay", "actuator_lag", SECOND_ORDER))


@pytest.fixture(scope="module")
def loose(aircraft) -> Fitted:
    """As ``late``, with a free play of 0.08 rad at the rudder."""
    wanted = ("actuator_backlash", "actuator_backlash of rudder", "actuator_backlash of each control", "imu_scale")
    return _fitted(aircraft, {"actuator_backlash": {"rudder": 0.08}}, 16, wanted)


@pytest.fixture(scope="module")
def late_and_scaled(aircraft) -> Fitted:
    """As ``late``, with a pitch gyroscope that reads 20 % too much besides."""
    effects = {"command_delay": {"delay": 0.1}, "imu_scale": {"q": 0.2}}
    return _fitted(aircraft, effects, 19, ("command_delay", "imu_scale"))


@pytest.fixture(scope="module")
def mistaken(aircraft) -> Fitted:
    """As ``late``, with effects that change derivatives, too."""
    wanted = ("command_delay", "derivative_error of Cm", "imu_scale", "cg_shift", "mass_error", "inertia_error",
              "thrust_scale")  # fmt: skip
    return _fitted(aircraft, {"command_delay": {"delay": 0.1}, "cg_shift": {"x": 0.02}}, 20, wanted)


@pytest.fixture(scope="module")
def stalling(aircraft) -> Fitted:
    """As ``late``, with a wing that stalls 8 chords of flight behind the angle of attack."""
    effect = {"stall_separation": {"depth": 1.0, "alpha_star": 0.17, "tau2": 8.0}}
    return _fitted(aircraft, effect, 17, ("stall_separation",))


def _fitted(aircraft, effects: Mapping[str, Mapping[str, float]], seed: int, wanted: tuple[str, ...]) -> Fitted:
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, effects, seed=seed))
    nuisances = nuisances_of(aircraft, model)
    fitter = CandidateFitter(nuisances, Checkpoint())
    candidates = {c.label: c for c in candidates_of(model.simulator, [model]) if c.label in wanted}
    return fitter, fitter.fit_set(unfitted([model], nuisances), []), candidates
