"""The rates that a flight needs: commands in steps more than smooth ones."""

import numpy as np
import pytest

from sysid_node.flight.logs.autopilot_log import AutopilotLog, LoggedCommands, Signal, absent
from sysid_node.flight.logs.rates import rate_of, rate_text, rates_of_log
from sysid_node.flight.logs.steps import MOSTLY, share_in_steps


def test_a_doublet_moves_in_steps_and_a_sine_does_not():
    """Truth: all of a doublet's movement is in its steps, none of a sine's."""
    time = np.arange(0.0, 10.0, 0.05)
    doublet = np.where((time > 2) & (time < 3), 0.1, 0.0) - np.where((time >= 3) & (time < 4), 0.1, 0.0)
    sine = 0.1 * np.sin(2.0 * time)
    assert share_in_steps(np.column_stack([sine, doublet])) == pytest.approx(1.0)
    assert share_in_steps(sine[:, np.newaxis]) == 0.0
    assert share_in_steps((doublet + sine)[:, np.newaxis]) < MOSTLY
    assert share_in_steps(np.zeros((3, 1))) == 0.0


def test_rates_are_said_as_people_write_them():
    assert [rate_text(rate) for rate in (2.96, 3.04, 4.8, 12.3, 205.2)] == ["3", "3", "4.8", "12", "205"]
    assert rate_of(np.array([0, 10_000_000, 20_000_000, 500_000_000])) == 100.0
    assert rate_of(np.array([5])) == 0.0


def test_a_log_of_steps_needs_a_higher_rate():
    """3-2-1-1 in steps at 25 Hz is refused, a sine at the same rate is not."""
    stamps = np.arange(0, 400, dtype=np.int64) * 40_000_000
    time = stamps / 1e9
    for commands, needed in ((np.sign(np.sin(1.7 * time)), 50.0), (np.sin(1.7 * time), 20.0)):
        other = Signal("IMU", stamps, np.zeros((400, 6)))
        controls = LoggedCommands(("elevator",), Signal("RCOU", stamps, 0.2 * commands[:, np.newaxis]))
        log = AutopilotLog("x", "ArduPlane", other, absent("ATT", 4), other, other, controls, controls)
        found = rates_of_log(log)["actuators"]
        assert found.needed == needed
        assert (found.fault == "RCOU comes at 25 Hz; 50 Hz are needed for commands in steps") == (needed == 50.0)
