"""Whether commands are told from positions, against servos of known time constants."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.commanded import JumpCounter, carried_in_words, known_from, take
from sysid_node.flight.servos import Servo, ServoState, give, move

SECOND = 1_000_000_000  # ns


def steps(rate, seconds=6.0, noise=0.0, seed=0):
    """Stamps (N,) ns and commands (N, 1) rad that jump between 0 and 0.06 with every 0.3 s."""
    time = np.arange(int(rate * seconds)) / rate
    noisy = noise * np.random.default_rng(seed).standard_normal(time.size)
    return np.round(SECOND * (1.0 + time)).astype(np.int64), (0.06 * (np.floor(time / 0.3) % 2) + noisy)[:, None]


def followed(stamps, commands, servo):
    """The positions (N, 1) of a servo, measured when it is commanded, with 1e-4 rad of noise."""
    state, found = ServoState(servo), []
    for stamp, command in zip(stamps.tolist(), commands[:, 0].tolist(), strict=True):
        give(state, stamp, command)
        found.append(move(state, stamp)[0])
    return np.array(found)[:, None] + 1e-4 * np.random.default_rng(1).standard_normal((len(found), 1))


@pytest.mark.parametrize("rate", [50.0, 100.0, 250.0])
def test_steps_are_commands(rate):
    """The second jump tells, two messages after it; feedback of noise does not hide it."""
    stamps, commands = steps(rate, noise=5e-4)
    known = known_from(stamps, commands)
    assert known is not None and (stamps[known] - stamps[0]) / SECOND == pytest.approx(0.6 + 2.0 / rate, abs=1e-6)


@pytest.mark.parametrize("rate", [50.0, 100.0, 250.0])
@pytest.mark.parametrize("servo", [Servo(0.02), Servo(0.06), Servo(0.02, 0.7), Servo(0.015, rate_limit=2.0)])
def test_positions_of_servos_are_not(rate, servo):
    stamps, commands = steps(rate)
    assert known_from(stamps, followed(stamps, commands, servo)) is None


def test_rare_messages_of_steps_tell_nothing():
    """At 10 Hz a servo is where it was commanded to be with the next message."""
    assert known_from(*steps(10.0)) is None


def test_a_single_jump_may_be_a_fault_of_a_sensor():
    stamps, commands = steps(100.0, 0.5)
    assert known_from(stamps, commands) is None


def test_smooth_commands_tell_nothing():
    time = np.arange(600) / 100.0
    wave = 0.06 * np.sin(2 * np.pi * 1.5 * time)[:, None]
    assert known_from(np.round(SECOND * (1.0 + time)).astype(np.int64), wave) is None


def test_an_ideal_file_wants_to_be_told_what_smooth_messages_are():
    aircraft = load_aircraft("cdrw")
    ideal = replace(aircraft, ideal=True)
    assert "state what they carry" in carried_in_words(ideal, "auto", commanded=False)
    assert "state" not in carried_in_words(aircraft, "auto", commanded=False)
    assert "state what" not in carried_in_words(ideal, "auto", commanded=True)
    assert carried_in_words(ideal, "positions", commanded=False) == ""


def test_surfaces_that_act_late_are_said_where_nobody_said_what_is_recorded():
    aircraft, late = load_aircraft("cdrw"), ["elevator", "rudder"]
    said = carried_in_words(aircraft, "auto", commanded=False, late=late)
    assert "elevator, rudder act later than recorded, as after commands" in said
    assert "But aileron acts later" in carried_in_words(aircraft, "auto", commanded=False, late=["aileron"])
    assert "later than" not in carried_in_words(aircraft, "auto", commanded=True, late=late)
    assert carried_in_words(aircraft, "positions", commanded=False, late=late) == ""


def test_message_by_message_the_same():
    stamps, commands = steps(100.0, noise=2e-3)
    counter, found = JumpCounter(), []
    for stamp, row in zip(stamps.tolist(), commands.tolist(), strict=True):
        take(counter, stamp, row)
        found.append(counter.commanded)
    assert found.index(True) == known_from(stamps, commands)
