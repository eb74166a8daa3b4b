"""Air data and attitude follow from the inertial instruments alone; truth: flights of this simulator, still air."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.fit import blank, polish, with_candidates
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import view_of
from sysid_node.gap.residuals.flight_path_reconstruction import READINGS
from sysid_node.gap.residuals.residual_model import CHANNELS, View
from sysid_node.sim import Simulator

FIRST = len(CHANNELS) - len(READINGS)
STEPS_ONCE = ["3211:elevator:start=2", "3211:aileron:start=8", "3211:rudder:start=14"]


@pytest.fixture(scope="module")
def turning(aircraft) -> View:
    return view_of(Simulator(aircraft, 50.0), fly(aircraft, {"imu_bias": {"q": 0.02}}, seed=11))


def power(view: View, theta) -> np.ndarray:
    return (np.abs(view.residual(theta)[:, 1:, FIRST:]) ** 2).mean(axis=(0, 1))


def test_only_noise_is_left_of_a_sound_aircraft(plain_view) -> None:
    left = power(plain_view, plain_view.simulator.neutral())
    assert (left < 1.6 * plain_view.noise[1:, FIRST:].mean(axis=0)).all()


def test_a_gyro_bias_is_in_the_pitch_angle_and_gone_with_the_truth(turning) -> None:
    simulator, pitch = turning.simulator, CHANNELS.index("theta")
    neutral, truth = simulator.neutral(), simulator.vector({"imu_bias": {"q": 0.02}})
    means = [abs(turning.residual(theta)[:, 0, pitch].mean()) for theta in (neutral, truth)]
    assert means[0] > 20.0 * means[1]


def test_no_aerodynamics_is_in_it(plain_view) -> None:
    names = plain_view.simulator.names
    indices = [i for i, n in enumerate(names) if n.startswith("derivative_error")]
    slopes = plain_view.slopes(plain_view.simulator.neutral(), indices)
    assert np.abs(slopes[:, :, FIRST:]).max() == 0.0


@pytest.mark.parametrize("name", ["imu_bias.q", "vane_scale.alpha", "airspeed_scale.error", "imu_lever_arm.x"])
def test_slopes_agree_with_differences(plain_view, name) -> None:
    neutral, step = plain_view.simulator.neutral(), np.zeros_like(plain_view.simulator.neutral())
    index = plain_view.simulator.names.index(name)
    step[index] = 1e-5
    numeric = (plain_view.predicted(neutral + step) - plain_view.predicted(neutral - step)) / 2e-5
    slopes = plain_view.slopes(neutral, [index])[..., 0]
    np.testing.assert_allclose(slopes[..., FIRST:], numeric[..., FIRST:], atol=1e-5 * np.abs(numeric).max())


def test_gusts_are_measured_by_the_vanes(aircraft, plain_view) -> None:
    """Light turbulence of MIL-F-8785C at low height: 15 kt of wind give about a metre per second."""
    gusty = view_of(Simulator(aircraft, 50.0), fly(aircraft, {}, seed=12, turbulence="light"))
    assert plain_view.gusts < 0.1
    assert 0.3 < gusty.gusts < 1.5
    assert float(gusty.given.memory.observer) < float(plain_view.given.memory.observer)


def test_moment_with_the_rate_of_alpha_is_found_despite_the_vane_noise(aircraft) -> None:
    """Truth: the simulator. By the vane's differences it is -5.0: what is differentiated is mostly noise."""
    view = view_of(Simulator(aircraft, 50.0), fly(aircraft, {"unsteady_aerodynamics": {"Cm_alphadot": -10.0}}))
    nuisances = nuisances_of(aircraft, view)
    candidates = [c for c in candidates_of(view.simulator, [view]) if c.effect == "unsteady_aerodynamics"]
    found = polish(with_candidates(polish(blank([view], nuisances)), candidates, nuisances, [0.5, 1.0]))
    assert found.values[1] == pytest.approx(-10.0, rel=0.1)


def test_a_lag_is_found_despite_the_vanes_noise(aircraft) -> None:
    """Most of the flight is quiet: by the vanes alone derivatives seem smaller there, and the lag makes up for it."""
    flight = fly(aircraft, {"actuator_lag": {"time_constant": 0.09}}, 3, manoeuvre=STEPS_ONCE, duration=60.0)
    view = view_of(Simulator(aircraft, 50.0), flight)
    by_vanes = replace(view, given=view.given._replace(memory=view.given.memory._replace(vane=jnp.zeros(()))))
    off = []
    for seen in (view, by_vanes):
        nuisances = nuisances_of(aircraft, seen)
        candidates = [c for c in candidates_of(seen.simulator, [seen]) if c.effect == "actuator_lag"]
        fit = polish(with_candidates(polish(blank([seen], nuisances)), candidates, nuisances, [0.05]))
        off.append(abs(fit.values[0] - 0.09))
    assert off[0] < 0.003 < 0.5 * off[1]
