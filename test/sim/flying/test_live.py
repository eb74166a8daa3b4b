"""The live flight against the rollout of the same chain, and effects that change in flight."""

import numpy as np
import pytest
from plain import three_axes

from sysid_node.errors import InputError
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.flying import live

SAMPLES = 200
EFFECTS = ["actuator_lag:time_constant=0.05", "command_delay:delay=0.03", "cg_shift:x=0.01"]


def fly(
    simulator: Simulator, theta: np.ndarray, commands: np.ndarray, air: live.LiveConditions
) -> list[live.LiveReading]:
    flight = live.start(simulator, trim_flight(simulator), air, theta)
    return [live.step(simulator, flight, row) for row in commands]


def test_step_by_step_is_the_rollout(simulator: Simulator) -> None:
    """The command of a step counts from the next sample on: the rollout's, one sample late."""
    trim, theta = trim_flight(simulator), simulator.vector(EFFECTS)
    commands = trim.command + three_axes(SAMPLES, simulator.step)
    whole = simulator.rollout(theta, trim.initial, simulator.inputs(np.vstack([commands[:1], commands[:-1]])))
    flown = fly(simulator, theta, commands, live.LiveConditions(noise=0.0))
    outputs = np.array([now.outputs for now in flown])
    # what the rollout unwraps and the live flight does not is not reached here
    np.testing.assert_allclose(outputs, whole.outputs, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose([now.state for now in flown], whole.states, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose([now.surfaces for now in flown], whole.surfaces, rtol=1e-9, atol=1e-9)


def test_effects_can_change_in_flight(simulator: Simulator) -> None:
    trim, sound = trim_flight(simulator), simulator.neutral()
    rolled = trim.command + np.array([0.0, 0.05, 0.0, 0.0])
    rates = []
    for theta in (sound, simulator.vector(["control_effectiveness_loss:aileron=1.0"])):
        flight = live.start(simulator, trim, live.LiveConditions(noise=0.0), sound)
        flight.theta = theta
        rates.append(max(abs(live.step(simulator, flight, rolled).outputs[3]) for _ in range(20)))
    assert rates[0] > 0.05
    assert rates[1] < 0.1 * rates[0]


def test_noise_is_the_files(simulator: Simulator) -> None:
    trim = trim_flight(simulator)
    flown = fly(simulator, simulator.neutral(), np.tile(trim.command, (400, 1)), live.LiveConditions(noise=2.0, seed=3))
    spread = np.std([now.outputs[3] for now in flown])
    assert spread == pytest.approx(2.0 * simulator.aircraft.noise["gyro"], rel=0.15)


def test_turbulence_shakes_and_repeats_without_a_jump(simulator: Simulator) -> None:
    trim = trim_flight(simulator)
    flight = live.start(simulator, trim, live.LiveConditions("light", noise=0.0, seed=1), simulator.neutral())
    gusts = flight.turbulence
    steps = np.abs(np.diff(np.vstack([gusts, gusts[:1]]), axis=0))
    assert steps[-1].max() < 1.5 * steps.max()
    assert np.std(gusts[:, 2]) == pytest.approx(1.0, rel=0.2)
    assert np.std([live.step(simulator, flight, trim.command).outputs[10] for _ in range(200)]) > 0.005


@pytest.mark.parametrize("effect", ["imu_delay:delay=0.01", "turbulence:intensity=1"])
def test_effects_that_a_live_flight_lacks_are_refused(simulator: Simulator, effect: str) -> None:
    with pytest.raises(InputError, match="live flight"):
        live.vector(simulator, [effect])


def test_unknown_turbulence_is_refused(simulator: Simulator) -> None:
    with pytest.raises(InputError, match="gale"):
        live.start(simulator, trim_flight(simulator), live.LiveConditions("gale"), simulator.neutral())
