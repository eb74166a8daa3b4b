"""The control law: commands that are always finite and within limits, and set-points that are tracked."""

import math

import numpy as np
import pytest
from flying import AIRCRAFT, LEVEL, STEP, beliefs, level
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid_node.control import controller
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import IdentifiedDerivative, Measurements, SetPoints
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.flying import live

ANY = st.floats(allow_nan=True, allow_infinity=True, width=32)
STATE = controller.init(AIRCRAFT, ControllerSettings())
LIMITS = [control.limit for control in AIRCRAFT.controls.values()]


@settings(max_examples=100, deadline=None)
@given(
    sensed=st.tuples(*[ANY] * 9),
    points=st.builds(SetPoints, ANY, ANY, ANY, ANY, ANY),
    estimate=st.builds(IdentifiedDerivative, ANY, ANY, ANY, st.booleans(), ANY),
    step=st.floats(0.0, 1.0),
)
def test_whatever_comes_in_a_flyable_command_goes_out(
    sensed: tuple[float, ...], points: SetPoints, estimate: IdentifiedDerivative, step: float
) -> None:
    now = (STATE.time if math.isfinite(STATE.time) else 0.0) + step
    controller.receive_estimates(STATE, now, {"Cm_de": estimate})
    command = controller.step(STATE, Measurements(now, *sensed), points)
    assert np.isfinite(command).all()
    assert (np.abs(command[:3]) <= np.array(LIMITS) + 1e-12).all()
    assert 0.0 <= command.thrust <= 30.0


def test_level_flight_asks_for_the_trim() -> None:
    state = controller.init(AIRCRAFT, ControllerSettings())
    trim = trim_flight(Simulator(AIRCRAFT, 100.0))
    command = controller.step(state, level(0.0), SetPoints())
    np.testing.assert_allclose(command[:3], trim.command[:3], atol=0.01)
    assert command.thrust == pytest.approx(trim.command[3], abs=0.5)


def test_commands_move_at_a_bounded_rate() -> None:
    state = controller.init(AIRCRAFT, ControllerSettings(command_rate=1.0))
    before = controller.step(state, level(0.0), SetPoints())
    after = controller.step(state, level(STEP, theta=LEVEL + 0.5, q=2.0), SetPoints(roll=0.8))
    assert np.abs(np.subtract(after[:3], before[:3])).max() <= 1.0 * STEP + 1e-12


def fly(
    points: SetPoints, seconds: float, excitation: float = 0.0
) -> tuple[controller.ControllerState, live.LiveReading]:
    """The simulator, its actuators lagging, under the controller at 100 Hz."""
    simulator = Simulator(AIRCRAFT, 100.0)
    trim = trim_flight(simulator)
    flight = live.start(
        simulator, trim, live.LiveConditions(noise=0.0), live.vector(simulator, ["actuator_lag:time_constant=0.05"])
    )
    state, command = controller.init(AIRCRAFT, ControllerSettings()), trim.command.tolist()
    for _ in range(round(seconds * 100)):
        now = live.step(simulator, flight, command)
        _, _, _, p, q, r, phi, theta, _, V, alpha, beta = now.outputs.tolist()
        sensed = Measurements(now.time, p, q, r, phi, theta, V, alpha, beta, now.density)
        command = controller.step(state, sensed, points, (excitation, 0.0, 0.0))
    return state, now


@pytest.mark.slow
@pytest.mark.parametrize(
    ("points", "columns", "wanted", "within"),
    [
        (SetPoints(roll=-0.2, pitch=0.15), (6, 7), (-0.2, 0.15), 0.005),
        # the error of sideslip is not integrated, as those of roll and pitch are
        (SetPoints(sideslip=0.05, airspeed=20.0), (11, 9), (0.05, 20.0), (0.0075, 0.5)),
    ],
)
def test_set_points_are_reached(
    points: SetPoints, columns: tuple[int, ...], wanted: tuple[float, ...], within: float | tuple[float, ...]
) -> None:
    _, now = fly(points, 10.0)
    assert (np.abs(now.outputs[list(columns)] - wanted) <= within).all()


def test_a_pitch_rate_is_tracked() -> None:
    _, now = fly(SetPoints(pitch_rate=0.1), 2.0)
    assert now.outputs[4] == pytest.approx(0.1, rel=0.1)


@pytest.mark.slow
def test_a_disturbance_is_integrated_away() -> None:
    """A constant deflection on top of the command, as a trim error: pitch comes back to where it should be."""
    _, now = fly(SetPoints(pitch=0.1), 10.0, excitation=0.02)
    assert now.outputs[7] == pytest.approx(0.1, abs=0.003)


def test_the_clock_may_step_back() -> None:
    state = controller.init(AIRCRAFT, ControllerSettings())
    controller.step(state, level(100.0), SetPoints())
    controller.receive_estimates(state, 100.0, beliefs())
    command = controller.step(state, level(3.0), SetPoints())
    assert np.isfinite(command).all()
    assert "no estimates for" in state.stale


def test_new_gains_do_not_move_the_surfaces() -> None:
    """Feedback holds a deflection, here against a trim error; other gains hold it from the first moment on."""
    state, now = fly(SetPoints(roll=0.2), 7.0, excitation=0.03)
    before = state.law.surfaces.command
    for axis in state.axes:
        axis.flown = axis.flown._replace(gains=0.6 * axis.flown.gains)
    _, _, _, p, q, r, phi, theta, _, V, alpha, beta = now.outputs.tolist()
    sensed = Measurements(now.time + 1e-3, p, q, r, phi, theta, V, alpha, beta, now.density)
    after = controller.step(state, sensed, SetPoints(roll=0.2), (0.03, 0.0, 0.0))
    assert after.elevator == pytest.approx(before[0], abs=5e-4)
    assert after[1:3] == pytest.approx(before[1:], abs=5e-3)  # one integral for two surfaces


@pytest.mark.parametrize(("rate", "delay"), [(50.0, 0.02), (50.0, 0.01), (200.0, 0.02)])
def test_a_delay_of_whole_or_half_steps_is_the_same_at_every_step(rate: float, delay: float) -> None:
    """Answers to a pitch rate that changes its sign with every sample are even, however the stamps are rounded."""
    state = controller.init(AIRCRAFT, ControllerSettings(delay=delay))
    rng = np.random.default_rng(1)
    times = 77.123456789 + np.arange(600) / rate + rng.uniform(-0.05, 0.05, 600) / rate
    commands = [
        controller.step(state, level(float(t), q=0.01 * (-1.0) ** k), SetPoints()).elevator for k, t in enumerate(times)
    ]
    jumps = np.abs(np.diff(commands))[300:]
    assert jumps.min() > 0.0
    assert jumps.max() < 1.1 * jumps.min()
