"""Air data and attitude follow from the inertial instruments alone; truth: flights of this simulator, still air."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.flight_path_reconstruction import READINGS
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.sim import Simulator

FIRST = len(CHANNELS) - len(READINGS)
STEPS_ONCE = ["3211:elevator:start=2", "3211:aileron:start=8", "3211:rudder:start=14"]


@pytest.fixture(scope="module")
def turning(aircraft) -> ResidualModel:
    return residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"imu_bias": {"q": 0.02}}, seed=11))


def power(model: ResidualModel, theta) -> np.ndarray:
    return (np.abs(model.residual(theta)[:, 1:, FIRST:]) ** 2).mean(axis=(0, 1))


def test_only_noise_is_left_of_a_sound_aircraft(plain_model) -> None:
    left = power(plain_model, plain_model.simulator.neutral())
    assert (left < 1.6 * plain_model.noise[1:, FIRST:].mean(axis=0)).all()


def test_a_gyro_bias_is_in_the_pitch_angle_and_gone_with_the_truth(turning) -> None:
    simulator, pitch = turning.simulator, CHANNELS.index("theta")
    neutral, truth = simulator.neutral(), simulator.vector({"imu_bias": {"q": 0.02}})
    means = [abs(turning.residual(theta)[:, 0, pitch].mean()) for theta in (neutral, truth)]
    assert means[0] > 20.0 * means[1]


def test_no_aerodynamics_is_in_it(plain_model) -> None:
    names = plain_model.simulator.names
    indices = [i for i, n in enumerate(names) if n.startswith("derivative_error")]
    slopes = plain_model.slopes(plain_model.simulator.neutral(), indices)
    assert np.abs(slopes[:, :, FIRST:]).max() == 0.0


@pytest.mark.parametrize("name", ["imu_bias.q", "vane_scale.alpha", "airspeed_scale.error", "imu_lever_arm.x"])
def test_slopes_agree_with_differences(plain_model, name) -> None:
    neutral, step = plain_model.simulator.neutral(), np.zeros_like(plain_model.simulator.neutral())
    index = plain_model.simulator.names.index(name)
    step[index] = 1e-5
    numeric = (plain_model.predicted(neutral + step) - plain_model.predicted(neutral - step)) / 2e-5
    slopes = plain_model.slopes(neutral, [index])[..., 0]
    np.testing.assert_allclose(slopes[..., FIRST:], numeric[..., FIRST:], atol=1e-5 * np.abs(numeric).max())


def test_gusts_are_measured_by_the_vanes(aircraft, plain_model) -> None:
    """Light turbulence of MIL-F-8785C at low height: 15 kt of wind give about a metre per second."""
    gusty = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {}, seed=12, turbulence="light"))
    assert plain_model.gusts < 0.1
    assert 0.3 < gusty.gusts < 1.5
    assert float(gusty.inputs.memory.observer) < float(plain_model.inputs.memory.observer)


def test_the_airs_rotation_is_taken_off_the_pitching_moment(aircraft) -> None:
    """Truth: the simulated gusts turn the aircraft. With their rotation as the vanes show it, only noise is left."""
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {}, seed=12, turbulence="light"))
    rotation, moment = model.simulator.names.index("turbulence.rotation"), CHANNELS.index("Cm")
    fast = model.windows.frequencies > 2.4
    left = []
    for share in (0.0, 1.0, 2.0):
        theta = model.simulator.neutral()
        theta[rotation] = share
        power = (np.abs(model.residual(theta)[:, fast, moment]) ** 2).mean(axis=0)
        left.append(power.sum() / model.noise[fast, moment].sum())
    assert left[1] < 1.5
    assert min(left[0], left[2]) > 5.0 * left[1]


def test_no_air_turns_without_vanes(aircraft, plain_model) -> None:
    gusty = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {}, seed=12, turbulence="light"))
    unseen = replace(gusty, inputs=gusty.inputs._replace(vanes=jnp.zeros(2)))
    for model in (plain_model, unseen):
        assert not np.any(model.flow(model.simulator.neutral()).air_rotation)


def test_moment_with_the_rate_of_alpha_is_found_despite_the_vane_noise(aircraft) -> None:
    """Truth: the simulator. By the vane's differences it is -5.0: what is differentiated is mostly noise."""
    model = residual_model_of(
        Simulator(aircraft, 50.0), fly(aircraft, {"unsteady_aerodynamics": {"Cm_alphadot": -10.0}})
    )
    nuisances = nuisances_of(aircraft, model)
    candidates = [c for c in candidates_of(model.simulator, [model]) if c.effect == "unsteady_aerodynamics"]
    found = converged(with_candidates(converged(unfitted([model], nuisances)), candidates, nuisances, [0.5, 1.0]))
    assert found.values[1] == pytest.approx(-10.0, rel=0.1)


@pytest.mark.slow
def test_a_lag_is_found_despite_the_vanes_noise(aircraft) -> None:
    """Most of the flight is quiet: by the vanes alone derivatives seem smaller there, and the lag makes up for it."""
    flight = fly(aircraft, {"actuator_lag": {"time_constant": 0.09}}, 3, manoeuvre=STEPS_ONCE, duration=60.0)
    model = residual_model_of(Simulator(aircraft, 50.0), flight)
    by_vanes = replace(model, inputs=model.inputs._replace(memory=model.inputs.memory._replace(vane=jnp.zeros(()))))
    off = []
    for seen in (model, by_vanes):
        nuisances = nuisances_of(aircraft, seen)
        candidates = [c for c in candidates_of(seen.simulator, [seen]) if c.label == "actuator_lag"]
        fit = converged(with_candidates(converged(unfitted([seen], nuisances)), candidates, nuisances, [0.05]))
        off.append(abs(fit.values[0] - 0.09))
    assert off[0] < 0.003 < 0.5 * off[1]
