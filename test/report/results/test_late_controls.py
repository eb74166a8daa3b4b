"""Deflections behind servos as estimated. Truth: a first-order lag of a sine, by its transfer function."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.results.late_controls import late_controls

TIME = np.arange(0.0, 20.0, 0.01)
OMEGA = 2.0 * np.pi * 0.8
CDRW = load_aircraft("cdrw")
SINES = np.column_stack([np.sin(OMEGA * TIME)] * 3)


def times(**late: float) -> dict[str, DerivativeEstimate]:
    return {n: DerivativeEstimate(n, t, 0.001, t - 0.002, t + 0.002, True, "ok") for n, t in late.items()}


def lagged(late: float) -> np.ndarray:
    return np.imag(np.exp(1j * OMEGA * TIME) / (1.0 + 1j * OMEGA * late))


def test_a_control_follows_its_servo_and_the_others_do_not() -> None:
    found = late_controls(CDRW, TIME, SINES, times(aileron=0.1), commanded=False)
    np.testing.assert_array_equal(found[:, [0, 2]], SINES[:, [0, 2]])
    np.testing.assert_allclose(found[200:, 1], lagged(0.1)[200:], atol=1e-3)


def test_of_commands_what_the_file_states_is_in_them_already() -> None:
    known = replace(CDRW, effects={"actuator_lag": {"elevator": UncertainValue(0.04)}})
    found = late_controls(known, TIME, SINES, times(elevator=0.1), commanded=True)
    np.testing.assert_allclose(found[200:, 0], lagged(0.06)[200:], atol=1e-3)


@pytest.mark.parametrize("late", [-0.02, float("nan"), 0.0])
def test_a_surface_ahead_is_read_earlier_and_what_is_not_known_changes_nothing(late: float) -> None:
    found = late_controls(CDRW, TIME, SINES, times(elevator=late), commanded=False)
    ahead = late if late < 0.0 else 0.0
    np.testing.assert_allclose(found[5:-5, 0], np.sin(OMEGA * (TIME - ahead))[5:-5], atol=1e-3)
