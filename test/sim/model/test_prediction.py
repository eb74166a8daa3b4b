"""Both views of the chain against each other: what a rollout shows, the prediction expects of its own signals."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from plain import make_aircraft, three_axes

from sysid_node.dynamics.atmosphere import air_density
from sysid_node.dynamics.vector import Vector
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.sim import EFFECTS, Simulator, trim_flight
from sysid_node.sim.model.prediction import (
    Accelerations,
    Signals,
    coefficient_slopes,
    coefficients,
    predict,
    predict_coefficients,
    signals_of,
)

SAMPLES = 601
INNER = slice(40, -40)  # without the ends, where shifts and differences lack neighbours


def signals_from(flight, commands) -> Signals:
    outputs, states = np.asarray(flight.outputs), np.asarray(flight.states)
    return Signals(
        rates=outputs[:, 3:6],
        air=outputs[:, 9:12],
        density=np.asarray(air_density(-states[:, 2], np)),
        commands=np.asarray(commands),
        climb=states[0, 2] - states[:, 2],
    )


def shown(simulator, flight, signals):
    """Coefficients by the aircraft file of what the instruments showed, rates differentiated."""
    outputs = np.asarray(flight.outputs)
    turning = np.zeros((len(outputs), 3))
    rates = outputs[:, 3:6]
    turning[2:-2] = (8 * (rates[3:-1] - rates[1:-3]) - (rates[4:] - rates[:-4])) * simulator.rate / 12
    seen = Accelerations(Vector(*outputs[:, :3].T), Vector(*turning.T))
    return np.stack(coefficients(simulator.model, signals, seen), axis=1)


def smooth_inputs(simulator, trim):
    """Deflections without edges, so that differences of rates are exact enough."""
    time = np.arange(SAMPLES) * simulator.step
    waves = [0.04 * np.sin(4 * time), 0.05 * np.sin(5 * time + 1), 0.08 * np.sin(3 * time + 2), np.sin(2 * time)]
    return simulator.inputs(trim.command + np.column_stack(waves) * np.sin(0.5 * time)[:, None] ** 2)


@pytest.fixture(scope="module")
def fast():
    return Simulator(make_aircraft(), 200.0)


#: Effects that this view leaves out on purpose, and why.
NOT_SEEN = {
    "steady_wind": "nothing on board feels it",
    "turbulence": "the vanes measure it",
    "gust": "the vanes measure it",
    "sensor_noise": "it is in the signals",
}


@pytest.mark.parametrize("effect", [None, "actuator_lag", "stall_separation", "structural_mode"])
def test_what_does_nothing_may_be_left_out(fast, effect):
    """Truth: the same with everything worked out."""
    theta = fast.neutral()
    for i, (name, parameter) in enumerate(fast.parameters):
        if name == effect and parameter.switch:
            theta[i] += 0.5 * parameter.scale
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    signals = signals_from(fast.rollout(fast.neutral(), trim.initial, inputs), inputs.commands)
    expected = partial(predict, fast.layout, fast.model, jnp.asarray(theta), signals, jnp.asarray(fast.step))
    whole, part = jax.jit(expected)(), jax.jit(expected)(theta != fast.neutral())
    for truth, found in zip(jax.tree.leaves(whole), jax.tree.leaves(part), strict=True):
        np.testing.assert_allclose(found, truth, rtol=0, atol=1e-12 * np.abs(truth).max())


@pytest.mark.parametrize("effect", [name for name in EFFECTS if name not in NOT_SEEN])
def test_prediction_expects_what_the_rollout_shows(fast, effect):
    theta = fast.neutral()
    for i, (name, parameter) in enumerate(fast.parameters):
        if name == effect and parameter.switch:
            theta[i] = np.clip(parameter.neutral + 0.5 * fast.scales[i], parameter.lower, parameter.upper)
        if name == effect == "actuator_rate_limit":
            theta[i] = 1.0 / 0.15  # slower than what is commanded
    theta[fast.names.index("stall_separation.alpha_star")] = 0.12  # within what is flown
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    flight = fast.rollout(theta, trim.initial, inputs)
    signals = signals_from(flight, inputs.commands)
    told = shown(fast, flight, signals)[INNER]
    expected = np.asarray(predict_coefficients(fast, theta, signals))[INNER]
    neutral = np.asarray(predict_coefficients(fast, fast.neutral(), signals))[INNER]
    error, effect_size = np.abs(expected - told).max(axis=0), np.abs(neutral - told).max(axis=0)
    scale = np.abs(told).max(axis=0)
    share = 0.2 if effect == "structural_mode" else 0.05  # its nod also turns the probe's lever arm, which is left in
    assert (error < share * effect_size + 4e-4 * scale).all(), f"{error / scale} of {effect_size / scale}"
    assert (effect_size > 2e-3 * scale).any()  # the effect shows


def test_neutral_prediction_is_the_true_coefficients(fast):
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    flight = fast.rollout(fast.neutral(), trim.initial, inputs)
    expected = np.asarray(predict_coefficients(fast, fast.neutral(), signals_from(flight, inputs.commands)))
    np.testing.assert_allclose(expected, flight.coefficients, atol=1e-10)


def test_turbulence_does_no_harm(fast):
    random = np.random.default_rng(1)
    gusts = np.zeros((SAMPLES, 6))
    gusts[:, :3] = 0.05 * random.standard_normal((SAMPLES, 3)).cumsum(axis=0)
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)._replace(gusts=gusts)
    flight = fast.rollout(fast.neutral(), trim.initial, inputs)
    expected = np.asarray(predict_coefficients(fast, fast.neutral(), signals_from(flight, inputs.commands)))
    np.testing.assert_allclose(expected, flight.coefficients, atol=1e-10)


@pytest.mark.parametrize("slope", [-20.0, 20.0])
@pytest.mark.parametrize("frequency", [2.0, 8.0, 40.0])
def test_no_mode_rings_without_end(slope, frequency):
    """Neither by its own nod, as large as it may be, nor by the steps it is carried on in at the diagnosis' rate."""
    slow = Simulator(make_aircraft(), 50.0)
    theta = slow.neutral()
    for name, value in {"gain": 5.0, "slope": slope, "frequency": frequency, "damping": 0.05}.items():
        theta[slow.names.index(f"structural_mode.{name}")] = value
    trim = trim_flight(slow)
    inputs = smooth_inputs(slow, trim)
    signals = signals_from(slow.rollout(slow.neutral(), trim.initial, inputs), inputs.commands)
    without, expected = (np.abs(predict_coefficients(slow, t, signals)).max() for t in (slow.neutral(), theta))
    assert expected < 3.0 * without


def test_slopes_agree_with_finite_differences(fast):
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    theta = fast.neutral()
    for i, (_, parameter) in enumerate(fast.parameters):
        theta[i] = np.clip(parameter.neutral + 0.313 * fast.scales[i], parameter.lower, parameter.upper)
    signals = signals_from(fast.rollout(fast.neutral(), trim.initial, inputs), inputs.commands)
    slopes = np.asarray(coefficient_slopes(fast, theta, signals))
    for i, name in enumerate(fast.names):
        h = np.zeros(len(theta))
        h[i] = 1e-5 * fast.scales[i]
        up, down = (np.asarray(predict_coefficients(fast, theta + s * h, signals)) for s in (1, -1))
        numeric = (up - down) / (2 * h[i])
        size = np.abs(numeric).max()
        assert np.abs(slopes[:, :, i] - numeric).max() <= 1e-3 * size + 1e-9, name


def test_signals_of_a_record(simulator):
    trim = trim_flight(simulator)
    inputs = simulator.inputs(trim.command + three_axes(SAMPLES, simulator.step))
    flight = simulator.rollout(simulator.neutral(), trim.initial, inputs)
    direct = signals_from(flight, inputs.commands)
    outputs, commands = np.asarray(flight.outputs), np.asarray(inputs.commands)
    columns = dict(zip(simulator.outputs, outputs.T, strict=True)) | {"rho": np.asarray(direct.density)}
    columns |= dict(zip(("de", "da", "dr", "thrust"), commands.T, strict=True))
    record = FlightRecord(np.arange(SAMPLES) * simulator.step, columns)
    for name, ours, theirs in zip(Signals._fields, signals_of(simulator, record), direct, strict=True):
        if name in ("velocity", "alpha_rate"):  # known to those who have the inertial instruments, too
            assert ours is theirs is None
            continue
        np.testing.assert_allclose(ours, theirs, atol=0.1 if name == "climb" else 1e-9, err_msg=name)
    del columns["beta"]
    with pytest.raises(InputError, match="no complete beta"):
        signals_of(simulator, FlightRecord(record.time, columns))
