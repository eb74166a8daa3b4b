"""The simulator against physics: conservation, order of convergence, and an independent second simulator."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from plain import DERIVATIVES, make_aircraft, three_axes
from scipy.integrate import solve_ivp

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.errors import InputError
from sysid_node.sim import EFFECTS, Simulator, trim_flight

SAMPLES = 301


@pytest.fixture(scope="module")
def flown(simulator):
    """A neutral three-axes flight: trim, inputs, outputs."""
    trim = trim_flight(simulator)
    inputs = simulator.inputs(trim.command + three_axes(SAMPLES, simulator.step))
    return trim, inputs, simulator.rollout(simulator.neutral(), trim.initial, inputs)


def fall_freely(rate: float):
    """A tumbling body without any aerodynamics, thrown upwards: states (SAMPLES, 13)."""
    simulator = Simulator(make_aircraft(dict.fromkeys(DERIVATIVES, 0.0)), rate)
    initial = simulator.initial(30.0, 0.1, 0.05, (0.4, 0.9, -0.3), (2.0, 1.0, -1.5))
    commands = np.zeros((SAMPLES, 4))
    return simulator, np.asarray(simulator.rollout(simulator.neutral(), initial, simulator.inputs(commands)).states)


def test_free_fall_keeps_energy_and_angular_momentum():
    simulator, x = fall_freely(200.0)
    Ixx, Iyy, Izz, Ixz = np.asarray(simulator.model.inertia)
    inertia = np.array([[Ixx, 0, -Ixz], [0, Iyy, 0], [-Ixz, 0, Izz]])
    rates, mass = x[:, 10:13], float(simulator.model.mass)
    spin = 0.5 * np.einsum("ni,ij,nj->n", rates, inertia, rates)
    energy = 0.5 * mass * (x[:, 3:6] ** 2).sum(1) - mass * GRAVITY * x[:, 2] + spin
    momentum = np.array([_to_earth(q) @ inertia @ w for q, w in zip(x[:, 6:10], rates, strict=True)])
    assert np.ptp(spin) < 1e-8 * spin[0]
    assert np.ptp(energy) < 1e-8 * abs(energy[0])
    assert np.abs(momentum - momentum[0]).max() < 1e-8 * np.linalg.norm(momentum[0])
    assert np.ptp(rates[:, 0]) > 1.0  # it does tumble


def _to_earth(q: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation  # noqa: PLC0415

    return Rotation.from_quat(q[[1, 2, 3, 0]]).as_matrix()


def test_free_fall_is_a_parabola():
    _, x = fall_freely(100.0)
    time = np.arange(len(x)) / 100.0
    climb = -(_to_earth(x[0, 6:10]) @ x[0, 3:6])[2]
    np.testing.assert_allclose(-x[:, 2], -x[0, 2] + climb * time - 0.5 * GRAVITY * time**2, atol=1e-6)


@pytest.mark.slow
def test_runge_kutta_is_of_fourth_order(aircraft):
    trim = trim_flight(Simulator(aircraft, 100.0))
    commands = np.tile(trim.command + np.array([0.03, 0.02, -0.04, 1.0]), (2561, 1))

    def end(rate: float) -> np.ndarray:
        """The state after 2 s; every flight has as many samples, so that one program flies them all."""
        simulator = Simulator(aircraft, rate)
        flight = simulator.rollout(simulator.neutral(), trim.initial, simulator.inputs(commands))
        return np.asarray(flight.states[round(2.0 * rate), 3:])

    exact = end(1280.0)
    rates = np.array([20.0, 40.0, 80.0, 160.0])
    errors = [np.linalg.norm(end(rate) - exact) for rate in rates]
    slope = np.polyfit(np.log(1.0 / rates), np.log(errors), 1)[0]
    assert 3.8 < slope < 4.3


def test_neutral_flight_equals_an_independent_simulator(simulator, flown):
    """Euler angles, dimensional equations, scipy's DOP853: Stevens, Lewis & Johnson (2016), ch. 1."""
    trim, inputs, flight = flown
    commands = np.asarray(inputs.commands)
    state = np.array([*trim.initial[3:6], 0, 0, 0, 0, trim.alpha, 0, trim.initial[2]])
    states = [state]
    for k in range(SAMPLES - 1):  # commands are linear between samples: one smooth piece at a time
        piece = lambda t, y, k=k: _rates(y, commands[k] + t * 100.0 * (commands[k + 1] - commands[k]))  # noqa: E731
        states.append(solve_ivp(piece, (0, 0.01), states[-1], method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1])
    ours, theirs = np.asarray(flight.outputs), np.array(states)
    np.testing.assert_allclose(ours[:, 3:9], theirs[:, 3:9], atol=1e-5)
    np.testing.assert_allclose(np.asarray(flight.states[:, 3:6]), theirs[:, :3], atol=1e-4)


def _rates(y: np.ndarray, command: np.ndarray) -> np.ndarray:
    d, (de, da, dr, T) = DERIVATIVES, command
    u, v, w, p, q, r, phi, theta, _, down = y
    m, S, b, c = 4.0, 0.5, 1.8, 0.28
    Ixx, Iyy, Izz, Ixz = 0.3, 0.35, 0.6, 0.02
    V = np.sqrt(u * u + v * v + w * w)
    alpha, beta = np.arctan2(w, u), np.arcsin(v / V)
    rho = 1.225 * (1 + 0.0065 * down / 288.15) ** (9.80665 / (287.05287 * 0.0065) - 1)
    qS, x, y_ = 0.5 * rho * V * V * S, q * c / (2 * V), b / (2 * V)
    CL = d["CL_0"] + d["CL_alpha"] * alpha + d["CL_q"] * x + d["CL_de"] * de
    CD = d["CD_0"] + d["CD_alpha"] * alpha + d["CD_q"] * x + d["CD_de"] * de
    Cm = d["Cm_0"] + d["Cm_alpha"] * alpha + d["Cm_q"] * x + d["Cm_de"] * de
    CY, Cl, Cn = (
        d[f"{k}_beta"] * beta + d[f"{k}_p"] * p * y_ + d[f"{k}_r"] * r * y_ + d[f"{k}_da"] * da + d[f"{k}_dr"] * dr
        for k in ("CY", "Cl", "Cn")
    )
    X, Y = qS * (-CD * np.cos(alpha) + CL * np.sin(alpha)) + T, qS * CY
    Z = qS * (-CD * np.sin(alpha) - CL * np.cos(alpha))
    L, M, N = qS * b * Cl, qS * c * Cm, qS * b * Cn
    G = Ixx * Izz - Ixz**2
    return np.array([
        X / m - GRAVITY * np.sin(theta) - q * w + r * v,
        Y / m + GRAVITY * np.cos(theta) * np.sin(phi) - r * u + p * w,
        Z / m + GRAVITY * np.cos(theta) * np.cos(phi) - p * v + q * u,
        (Ixz * (Ixx - Iyy + Izz) * p * q - (Izz * (Izz - Iyy) + Ixz**2) * q * r + Izz * L + Ixz * N) / G,
        ((Izz - Ixx) * p * r - Ixz * (p**2 - r**2) + M) / Iyy,
        (((Ixx - Iyy) * Ixx + Ixz**2) * p * q - Ixz * (Ixx - Iyy + Izz) * q * r + Ixz * L + Ixx * N) / G,
        p + np.tan(theta) * (q * np.sin(phi) + r * np.cos(phi)),
        q * np.cos(phi) - r * np.sin(phi),
        (q * np.sin(phi) + r * np.cos(phi)) / np.cos(theta),
        -u * np.sin(theta) + v * np.sin(phi) * np.cos(theta) + w * np.cos(phi) * np.cos(theta),
    ])  # fmt: skip


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_does_nothing_while_its_switches_are_neutral(simulator, flown, effect):
    trim, inputs, flight = flown
    theta = simulator.neutral()
    for i, (name, parameter) in enumerate(simulator.parameters):
        if name == effect and not parameter.switch:
            theta[i] = min(parameter.neutral + 0.5 * parameter.scale, parameter.upper)
    changed = simulator.rollout(theta, trim.initial, inputs)
    np.testing.assert_allclose(changed.outputs, flight.outputs, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
def test_slopes_agree_with_finite_differences(simulator, flown):
    """At a point where every effect acts, so that no derivative is zero because its switch is neutral."""
    trim, inputs, _ = flown
    random = np.random.default_rng(0)
    inputs = inputs._replace(
        turbulence=jnp.asarray(random.standard_normal((SAMPLES, 6)).cumsum(0) * 0.03),
        noise=jnp.asarray(random.standard_normal((SAMPLES, 12))),
    )
    theta = simulator.neutral()
    for i, (_, parameter) in enumerate(simulator.parameters):
        theta[i] = np.clip(parameter.neutral + 0.313 * simulator.scales[i], parameter.lower, parameter.upper)
        theta[i] = 1.0 if parameter.name in ("onset", "start") else theta[i]
    slopes = np.asarray(simulator.jacobian(theta, trim.initial, inputs))
    for i, name in enumerate(simulator.names):
        h = np.zeros(len(theta))
        h[i] = 2e-5 * simulator.scales[i]
        up, down = (simulator.rollout(theta + s * h, trim.initial, inputs).outputs for s in (1, -1))
        numeric = np.asarray(up - down) / (2 * h[i])
        size = np.abs(numeric).max(axis=0)
        error = np.abs(slopes[:, :, i] - numeric).max(axis=0)
        assert np.isfinite(slopes[:, :, i]).all(), name
        assert (error <= 2e-4 * size + 1e-6 * size.max()).all(), f"{name}: {error / (size + 1e-12)}"


@pytest.mark.slow
def test_slopes_at_neutral_are_finite_and_see_every_switch(simulator, flown):
    """All but those of effects that need more than a slope: the rate limit (a corner) and what acts on nothing here."""
    trim, inputs, _ = flown
    slopes = np.abs(np.asarray(simulator.jacobian(simulator.neutral(), trim.initial, inputs))).max(axis=(0, 1))
    assert np.isfinite(slopes).all()
    unseen = {
        name
        for name, s, (_, p) in zip(simulator.names, slopes, simulator.parameters, strict=True)
        if p.switch and s < 1e-9
    }
    assert unseen == {
        *(f"actuator_rate_limit.{key}" for key in ("inverse_rate", "elevator", "aileron", "rudder")),
        "steady_wind.north", "steady_wind.east",  # nothing on board feels it; down changes the air density
        "turbulence.intensity", "sensor_noise.scale",  # no realisation given
    }  # fmt: skip


@pytest.mark.slow
def test_rollouts_may_be_batched(simulator, flown):
    trim, inputs, flight = flown
    thetas = np.stack([simulator.neutral(), simulator.vector(["mass_error:error=0.05"])])
    batch = jax.vmap(simulator.rollout, in_axes=(0, None, None))(thetas, trim.initial, inputs)
    np.testing.assert_allclose(batch.outputs[0], flight.outputs, rtol=1e-9, atol=1e-9)
    assert np.abs(batch.outputs[1] - batch.outputs[0]).max() > 0.01


@pytest.mark.parametrize(("elevator", "when"), [(np.nan, r"0\.00"), (0.2, r"0\.\d\d")])
def test_divergence_is_one_clear_line(elevator, when):
    """Impossible numbers, and an aircraft whose model adds energy to the motion."""
    simulator = Simulator(make_aircraft({**DERIVATIVES, "Cm_q": 2000.0, "CD_0": -5.0}), 100.0)
    initial = simulator.initial(18.0, 0.1, 0.0, (0.0, 0.1, 0.0))
    commands = np.tile([elevator, 0, 0, 4.0], (SAMPLES, 1))
    flight = simulator.rollout(simulator.neutral(), initial, simulator.inputs(commands))
    with pytest.raises(InputError, match=rf"diverged at {when} s; use smaller"):
        simulator.check(flight)


def test_missing_inertia_is_named(aircraft):
    broken = dataclasses.replace(aircraft, inertia=dataclasses.replace(aircraft.inertia, Ixx=float("nan")))
    with pytest.raises(InputError, match="inertia without Ixx: simulation needs Ixx"):
        _ = Simulator(broken).model
