"""ArduPilot's outputs become fractions of full stick, whatever the mixer's gain. Truth: the mixer of ArduPlane."""

import numpy as np
import pytest
from simulated_logs import LAYOUTS, pulses_of

from sysid_node.flight.logs.autopilot_log import LoggedCommands, Signal
from sysid_node.flight.logs.readers.ardupilot_controls import control_commands

#: Full stick to either side in roll, pitch and yaw, and a mixture that no gain below limits.
STICKS = np.vstack([np.eye(3), -np.eye(3), [[0.1, -0.3, 0.2]]])


def read(layout, mixing, sticks):
    """The controls of a log in which the sticks (N, 3) were held one after the other."""
    pulses = pulses_of(np.column_stack([sticks, np.full(len(sticks), 0.4)]), layout, mixing).astype(float)
    stamps = np.arange(len(sticks), dtype=np.int64)
    keys = ("FUNCTION", "MIN", "MAX", "TRIM", "REVERSED")
    rows = LAYOUTS[layout].items()
    parameters = {f"SERVO{n}_{key}": value for n, row in rows for key, value in zip(keys, row, strict=True)}
    outputs = LoggedCommands(("out1", "out2", "out3", "out4"), Signal("RCOU", stamps, pulses))
    return control_commands(outputs, {**parameters, **mixing})


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(
    "mixing",
    [
        {},
        {"MIXING_GAIN": 0.5, "MIXING_OFFSET": 0},
        {"MIXING_GAIN": 1.0},
        {"MIXING_GAIN": 0.7, "MIXING_OFFSET": -40},
        {"MIXING_OFFSET": 60},
        {"MIXING_GAIN": 0.3, "MIXING_OFFSET": 200},
    ],
)
def test_full_stick_is_one(layout, mixing):
    """A pulse is known to 0.5 us of 400 or more, and an axis from two of them through the gain."""
    controls, remarks = read(layout, mixing, STICKS)
    assert remarks == ()
    assert controls.names == ("aileron", "elevator", "rudder", "throttle")
    np.testing.assert_allclose(controls.signal.values[:, :3], -STICKS, atol=4e-3)


@pytest.mark.parametrize("layout", ["elevons", "V-tail"])
def test_a_surface_moves_no_further_than_its_travel(layout):
    """At a gain of 1.2 full stick is the full travel, of which a stick of 0.5 moves the surface by 0.6."""
    controls, _ = read(layout, {"MIXING_GAIN": 1.2}, np.vstack([STICKS[:6], [[0.0, 0.5, 0.0]]]))
    np.testing.assert_allclose(controls.signal.values[:6, :3], -STICKS[:6], atol=4e-3)
    np.testing.assert_allclose(controls.signal.values[6, 1], -0.6, atol=4e-3)


def test_reverse_thrust_is_on_the_other_side_of_the_trim():
    """ArduPlane's ``set_control_channels``: with THR_MIN below 0 the throttle's output is an angle about its trim."""
    parameters = {"SERVO1_FUNCTION": 19, "SERVO2_FUNCTION": 70, "SERVO2_MIN": 1000, "SERVO2_MAX": 2000, "THR_MIN": -100}
    pulses = np.array([[1500.0, 1000.0], [1500.0, 1500.0], [1500.0, 2000.0]])
    outputs = LoggedCommands(("out1", "out2"), Signal("RCOU", np.arange(3), pulses))
    controls, _ = control_commands(outputs, parameters | {"SERVO2_TRIM": 1500})
    np.testing.assert_allclose(controls.signal.values[:, 1], [-1.0, 0.0, 1.0])
    controls, _ = control_commands(outputs, parameters | {"THR_MIN": 0})
    np.testing.assert_allclose(controls.signal.values[:, 1], [0.0, 0.5, 1.0])


def test_a_gain_of_zero_is_said():
    controls, remarks = read("elevons", {"MIXING_GAIN": 0.0}, STICKS)
    assert controls.names == ("rudder", "throttle")
    assert remarks == ("MIXING_GAIN is 0: elevons and V-tails do not move",)
