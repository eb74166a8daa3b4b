"""PX4's servos become fractions of full stick, whatever the torques are. Truth: the pseudo-inverse, solved by hand."""

import numpy as np
import pytest

from sysid_node.flight.logs.autopilot_log import Signal, absent
from sysid_node.flight.logs.readers.px4_controls import control_commands

STICKS = np.vstack([np.eye(3), -np.eye(3)])
KINDS = {"elevons": (5, 6, 4), "V-tail": (15, 7, 8), "A-tail": (15, 13, 14)}


def parameters_of(layout: str, size: float) -> dict[str, float]:
    """Torques of a pair of surfaces, each of them ``size``, and of a third surface that acts on the other axis."""
    torques = {
        "elevons": [(-size, size, 0.0), (size, size, 0.0), (0.0, 0.0, 1.0)],
        "V-tail": [(1.0, 0.0, 0.0), (0.0, size, size), (0.0, size, -size)],
        "A-tail": [(1.0, 0.0, 0.0), (0.0, size, -size), (0.0, size, size)],
    }[layout]
    parameters: dict[str, float] = {"CA_AIRFRAME": 1, "CA_SV_CS_COUNT": 3}
    for i, (kind, row) in enumerate(zip(KINDS[layout], torques, strict=True)):
        parameters[f"CA_SV_CS{i}_TYPE"] = kind
        parameters |= {f"CA_SV_CS{i}_TRQ_{axis}": value for axis, value in zip("RPY", row, strict=True)}
    return parameters


def servos_of(layout: str, size: float, sticks: np.ndarray) -> np.ndarray:
    """What PX4 commands: torques +-size of two surfaces in two axes are inverted by their half over the size."""
    roll, pitch, yaw = (sticks / (2.0 * size)).T
    columns = {
        "elevons": [pitch - roll, pitch + roll, sticks[:, 2]],
        "V-tail": [sticks[:, 0], pitch + yaw, pitch - yaw],
        "A-tail": [sticks[:, 0], pitch - yaw, pitch + yaw],
    }[layout]
    return np.clip(np.column_stack(columns), -1.0, 1.0)


def read(parameters: dict[str, float], servos: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
    stamps = np.arange(len(servos), dtype=np.int64)

    def topic(name: str, columns: tuple[str, ...]) -> Signal:
        known = name == "actuator_servos"
        return Signal(name, stamps, servos[:, : len(columns)]) if known else absent(name, len(columns))

    controls, _ = control_commands(topic, parameters, vtol=False)
    return controls.names, controls.signal.values


@pytest.mark.parametrize("layout", KINDS)
@pytest.mark.parametrize("size", [0.5, 1.0, 0.8, 0.25])
def test_full_stick_is_one(layout, size):
    """0.5 is PX4's own, at which full stick is full travel; below it the surface reaches its end before the stick."""
    names, values = read(parameters_of(layout, size), servos_of(layout, size, STICKS))
    assert names == ("aileron", "elevator", "rudder")
    np.testing.assert_allclose(values, -STICKS, atol=1e-12)


def test_without_torques_full_stick_is_the_full_travel():
    parameters = {k: v for k, v in parameters_of("elevons", 0.5).items() if "TRQ" not in k}
    _, values = read(parameters, servos_of("elevons", 0.5, STICKS))
    np.testing.assert_allclose(values, -STICKS, atol=1e-12)


def test_an_ailerons_small_torque_in_yaw_does_not_make_it_a_rudder():
    """Ailerons (roll 0.5, yaw 0.05) move by the yaw command, too, by which they are deflected: that is aileron."""
    rows = [(-0.5, 0.0, 0.05), (0.5, 0.0, -0.05), (0.0, 0.0, 1.0)]
    parameters: dict[str, float] = {"CA_AIRFRAME": 1, "CA_SV_CS_COUNT": 3}
    for i, (kind, row) in enumerate(zip((1, 2, 4), rows, strict=True)):
        parameters[f"CA_SV_CS{i}_TYPE"] = kind
        parameters |= {f"CA_SV_CS{i}_TRQ_{axis}": value for axis, value in zip("RPY", row, strict=True)}
    names, values = read(parameters, np.array([[-1.0, 1.0, 0.0], [-0.2, 0.2, 0.0], [0.0, 0.0, 1.0]]))
    assert names == ("aileron", "rudder")
    np.testing.assert_allclose(values, [[-1.0, 0.0], [-0.2, 0.0], [0.0, -1.0]], atol=0.01)


def test_a_flaps_torques_count_for_nothing():
    parameters = {**parameters_of("elevons", 0.5), "CA_SV_CS_COUNT": 4}
    parameters |= {"CA_SV_CS3_TYPE": 9, "CA_SV_CS3_TRQ_R": -0.5}
    servos = np.column_stack([servos_of("elevons", 0.5, STICKS), np.full(len(STICKS), 0.7)])
    names, values = read(parameters, servos)
    assert names == ("aileron", "elevator", "rudder", "flap")
    np.testing.assert_allclose(values[:, :3], -STICKS, atol=1e-12)


def test_a_torque_of_another_time_is_not_used():
    """The servos are logged for 10 s, the torque from 30 s on. Truth: the servos' own commands."""
    sticks = np.tile(STICKS, (100, 1))
    stamps = np.arange(len(sticks), dtype=np.int64) * 16_000_000
    servos = servos_of("elevons", 0.5, sticks)

    def topic(name: str, columns: tuple[str, ...]) -> Signal:
        if name == "actuator_servos":
            return Signal(name, stamps, servos[:, : len(columns)])
        if name == "vehicle_torque_setpoint":
            later = 30_000_000_000 + np.arange(5000, dtype=np.int64) * 4_000_000
            return Signal(name, later, np.zeros((5000, len(columns))))
        return absent(name, len(columns))

    controls, remarks = control_commands(topic, parameters_of("elevons", 0.5), vtol=False)
    assert controls.signal.source == "actuator_servos"
    assert remarks == ()
    np.testing.assert_allclose(controls.signal.values[:, 1], -sticks[:, 1], atol=1e-12)


def test_servos_on_both_banks_are_read_from_their_pulses():
    """Truth: an aileron at output 2 of MAIN and an elevator at output 1 of AUX, half of the travel from the middle."""
    parameters: dict[str, float] = {"CA_AIRFRAME": 1, "CA_SV_CS_COUNT": 2, "PWM_MAIN_FUNC2": 201, "PWM_AUX_FUNC1": 202}
    parameters |= {"CA_SV_CS0_TYPE": 15, "CA_SV_CS0_TRQ_R": 1.0, "CA_SV_CS1_TYPE": 3, "CA_SV_CS1_TRQ_P": 1.0}
    stamps = np.arange(10, dtype=np.int64) * 10_000_000
    pulses = {("actuator_outputs", "output[1]"): 1750.0, ("actuator_outputs/1", "output[0]"): 1250.0}

    def topic(name: str, columns: tuple[str, ...]) -> Signal:
        if not name.startswith("actuator_outputs"):
            return absent(name, len(columns))
        values = [np.full(10, pulses.get((name, column), 900.0)) for column in columns]
        return Signal(name, stamps, np.column_stack(values))

    controls, _ = control_commands(topic, parameters, vtol=False)
    assert controls.names == ("aileron", "elevator")
    np.testing.assert_allclose(controls.signal.values, np.tile([-0.5, 0.5], (10, 1)))
