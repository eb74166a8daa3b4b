"""Flights with autopilot, turbulence and noise, and their recorded messages."""

import tracemalloc

import numpy as np
import pytest
from plain import make_aircraft, three_axes

from sysid_node.aircraft.model import Control
from sysid_node.errors import InputError
from sysid_node.flight.servos import Servo, ServoState, give, move
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import START_NS, FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie

RATE, SECONDS = 200.0, 12.0


@pytest.fixture(scope="module")
def fast():
    return Simulator(make_aircraft(), RATE)


@pytest.fixture(scope="module")
def moves(fast):
    return three_axes(round(SECONDS * RATE) + 1, fast.step)


@pytest.fixture(scope="module")
def sortie(fast, moves):
    return fly_sortie(fast, moves, SortieConditions(turbulence="light", seed=4))


def columns(sortie):
    return dict(zip(sortie.simulator.outputs, np.asarray(sortie.flight.outputs).T, strict=True))


@pytest.mark.slow
def test_the_autopilot_holds_attitude_and_speed(fast):
    """In turbulence the autopilot keeps attitude and airspeed closer to the trim than the aircraft alone does."""
    still = np.zeros((round(30.0 * RATE) + 1, 4))
    held, free = (
        columns(
            fly_sortie(fast, still, SortieConditions(turbulence="moderate", seed=1, noise=0.0, autopilot=autopilot))
        )
        for autopilot in (True, False)
    )
    for name in ("phi", "theta"):
        assert held[name].std() < 0.5 * free[name].std(), name
    assert abs(held["V"][-1000:].mean() - 18.0) < 1.0


@pytest.mark.slow
def test_recorded_commands_fly_the_same_flight_again(sortie):
    """The commands of the autopilot, flown open loop in the same gusts, give the same flight."""
    again = sortie.simulator.rollout(
        sortie.theta, sortie.trim.initial, sortie.inputs._replace(commands=sortie.flight.commands)
    )
    np.testing.assert_allclose(again.outputs, sortie.flight.outputs, atol=1e-6)


@pytest.mark.slow
def test_delays_reach_the_autopilots_commands_too(fast, moves):
    sortie = fly_sortie(fast, moves, SortieConditions(["command_delay:delay=0.0625"], seed=4))
    again = fast.rollout(sortie.theta, sortie.trim.initial, sortie.inputs._replace(commands=sortie.flight.commands))
    np.testing.assert_allclose(again.outputs, sortie.flight.outputs, atol=1e-6)


def test_truth_of_a_sortie(fast, moves):
    sortie = fly_sortie(fast, moves, SortieConditions(["derivative_error:Cm_alpha=-0.1"]))
    assert sortie.derivatives["Cm_alpha"] == pytest.approx(-0.7)
    assert sortie.effects["sensor_noise"] == {"scale": 1.0}


def test_rotary_gusts_may_be_left_out(fast, moves):
    gusts = [
        fly_sortie(fast, moves, SortieConditions(turbulence="light", rotary_gusts=on)).inputs.turbulence
        for on in (0, 1)
    ]
    np.testing.assert_array_equal(gusts[0][:, :3], gusts[1][:, :3])
    assert not gusts[0][:, 3:].any() and gusts[1][:, 3:].all()


def test_the_seed_determines_the_flight(fast, moves, sortie):
    again = fly_sortie(fast, moves, sortie.conditions)
    np.testing.assert_array_equal(again.flight.outputs, sortie.flight.outputs)
    other = fly_sortie(fast, moves, SortieConditions(turbulence="light", seed=5))
    assert np.abs(other.flight.outputs - sortie.flight.outputs).max() > 0.1


def test_streams_have_their_rates_and_stamps(sortie):
    streams = FlightSampler().record(sortie)
    span = SECONDS
    assert [len(s.arrival) for s in streams.by_topic.values()] == [200 * span + 1, 100 * span + 1, 100 * span + 1]
    stamps = streams.imu.arrival.stamp_ns
    assert stamps[0] >= START_NS
    period = np.diff(stamps) / 1e9
    assert period.mean() == pytest.approx(0.005, rel=1e-3)
    assert 0.0001 < period.std() < 0.0005
    assert (streams.imu.arrival.log_ns >= stamps).all()
    order = np.concatenate([s.arrival.order for s in streams.by_topic.values()])
    assert sorted(order) == list(range(order.size))


def test_readings_are_the_flight_at_the_stamps(fast, moves):
    quiet = fly_sortie(fast, moves, SortieConditions(noise=0.0))
    streams = FlightSampler(quantise=False).record(quiet)
    time = (streams.imu.arrival.stamp_ns - START_NS) / 1e9
    outputs, grid = np.asarray(quiet.flight.outputs), np.arange(len(moves)) * fast.step
    for i, name in enumerate(("p", "q", "r"), start=3):
        between = np.interp(time, grid, outputs[:, i])
        np.testing.assert_allclose(streams.imu.values[:, i], between, atol=3e-3, err_msg=name)
    at = (streams.actuators.arrival.stamp_ns - START_NS) / 1e9
    elevator = np.interp(at, grid, np.asarray(quiet.flight.commands)[:, 0])
    np.testing.assert_allclose(streams.actuators.positions[:, 0], elevator, atol=1e-7)  # stamps are whole ns
    thrust = np.interp(at, grid, np.asarray(quiet.flight.commands)[:, 3])
    np.testing.assert_allclose(streams.actuators.positions[:, 3] * 30.0, thrust, atol=1e-6)


def test_noise_and_quantisation(fast, moves, sortie):
    streams = FlightSampler().record(sortie)
    clean = FlightSampler(quantise=False).record(
        fly_sortie(fast, moves, SortieConditions(turbulence="light", seed=4, noise=0.0))
    )
    step = 32 * 9.80665 / 2**16
    ratio = streams.imu.values[:, :3] / step
    np.testing.assert_allclose(ratio, np.round(ratio), atol=1e-6)
    # the autopilot answers to noise, so that the flights differ a little: their difference is mostly noise
    sigma = (streams.air_data.values - clean.air_data.values).std(axis=0)
    assert sigma[:3] == pytest.approx([0.3, 0.005, 0.005], rel=0.1)


def test_stamp_delay_of_the_actuators(fast, moves):
    recorder = FlightSampler(jitter=0.0)
    late = recorder.record(fly_sortie(fast, moves, SortieConditions(["actuator_stamp_delay:delay=0.05"], noise=0.0)))
    plain = recorder.record(fly_sortie(fast, moves, SortieConditions(noise=0.0)))
    np.testing.assert_allclose(late.actuators.positions[5:], plain.actuators.positions[:-5], atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "servo"),
    [
        (["actuator_lag:time_constant=0.05"], Servo(0.05)),
        (["actuator_lag:time_constant=0.05", "command_delay:delay=0.02"], Servo(0.05, delay=0.02)),
        (["actuator_lag:time_constant=0.05:damping=0.7"], Servo(0.05, 0.7)),
    ],
)
def test_recorded_commands_move_the_surfaces_as_the_servo_model_says(fast, moves, effects, servo):
    """The identifier's servo, from the messages of the commands alone, against the simulator's own surfaces.

    The simulator ramps to a command within a step h, the servo jumps in its middle: they differ by h^2 / 24 T^2 of it.
    """
    conditions = SortieConditions(effects, autopilot=False, noise=0.0, command_rate=50.0)
    steps = 0.05 * np.sign(np.sin(2.0 * np.pi * np.arange(len(moves)) * fast.step))[:, None] * [1.0, 1.0, 1.0, 0.0]
    sortie = fly_sortie(fast, steps[:800], conditions)
    commands = FlightSampler().commands(sortie)
    assert np.diff(commands.arrival.stamp_ns)[1:] == pytest.approx(20_000_000, abs=1)
    state, found = ServoState(servo), []
    for stamp, row in zip(commands.arrival.stamp_ns.tolist(), commands.positions.tolist(), strict=True):
        give(state, stamp, row[0])
    for i in range(800):
        found.append(move(state, START_NS + round(i * fast.step * 1e9))[0])
    expected = np.asarray(sortie.flight.surfaces)[:, 0]
    resolution, curvature = 2.0**-15, 0.1 * (fast.step / 0.05) ** 2 / 24.0
    settled = np.abs(np.diff(np.asarray(sortie.flight.commands)[:, 0], prepend=0.0)) == 0.0  # not within a ramp
    np.testing.assert_allclose(np.array(found)[settled], expected[settled], atol=resolution + 2.0 * curvature)


def test_measured_surfaces_and_mixed_joints(moves):
    mix = {"elevator": {"left": 0.5, "right": 0.5}, "aileron": {"left": 0.5, "right": -0.5}}
    symbols = {"elevator": "de", "aileron": "da", "rudder": "dr"}
    joints = {**mix, "rudder": {"rudder": 1.0}}
    controls = {n: Control(n, symbols[n], joints[n], limit=0.4, offset=0.01) for n in symbols}
    simulator = Simulator(make_aircraft(controls=controls), RATE)
    sortie = fly_sortie(simulator, moves, SortieConditions(["actuator_lag:time_constant=0.1"], noise=0.0))
    streams = FlightSampler(surfaces="measured", jitter=0.0).record(sortie)
    assert streams.actuators.names == ("left", "right", "rudder", "throttle")
    left, right = streams.actuators.positions[:, 0], streams.actuators.positions[:, 1]
    surfaces = np.asarray(sortie.flight.surfaces)[::2]
    np.testing.assert_allclose(0.5 * (left + right) + 0.01, surfaces[:, 0], atol=1e-9)
    np.testing.assert_allclose(0.5 * (left - right) + 0.01, surfaces[:, 1], atol=1e-9)


@pytest.mark.parametrize(
    ("conditions", "pattern"),
    [
        (SortieConditions(turbulence="heavy"), "'heavy': expected one of none, light, moderate, severe"),
        (SortieConditions(airspeed=3.0), "no steady flight at 3 m/s"),
        (SortieConditions({"nonsense": {}}), "'nonsense' is not known"),
    ],
)
def test_bad_conditions(fast, moves, conditions, pattern):
    with pytest.raises(InputError, match=pattern):
        fly_sortie(fast, moves, conditions)


def test_travel_is_checked_with_trim(fast, moves):
    with pytest.raises(InputError, match=r"elevator reaches .* rad at 0\.\d\d s, but its limit is 0.4"):
        fly_sortie(fast, 10.0 * moves)


def test_bad_recorders():
    with pytest.raises(InputError, match="air_data_rate 0 Hz: expected 1 to 5000"):
        FlightSampler(air_data_rate=0.0)
    with pytest.raises(InputError, match="expected commanded or measured"):
        FlightSampler(surfaces="guessed")


@pytest.mark.slow
def test_recording_takes_little_memory_beside_the_flight(fast):
    """Truth: at 10 Hz there is little to record, and the flight itself is the measure."""
    sortie = fly_sortie(fast, np.zeros((round(60.0 * RATE) + 1, 4)), SortieConditions(seed=4))
    outputs = np.asarray(sortie.flight.outputs)
    tracemalloc.start()
    FlightSampler(10.0, 10.0, 10.0).record(sortie)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3.0 * outputs.nbytes
