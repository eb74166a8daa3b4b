"""Lateness taken out of records, against the exact response of servos (SciPy's ``lsim``)."""

from dataclasses import replace

import numpy as np
import pytest
from made_flight import KESTREL
from scipy.signal import lsim

from sysid_node.aircraft.model import UncertainValue
from sysid_node.batch.systematic.clocks import corrected
from sysid_node.batch.systematic.flight_posterior import Imperfection
from sysid_node.flight.record import FlightRecord
from sysid_node.online.systematic.servo_model import CUBIC

TIME = np.arange(0.0, 20.0, 0.01)
SIGNAL = np.exp(-(((TIME - 10.0) / 5.0) ** 6)) * (0.1 * np.sin(2.0 * TIME) + 0.05 * np.sin(5.0 * TIME + 1.0))


def servo(role: str, *, commanded: bool = True) -> Imperfection:
    return Imperfection("actuator_lag.elevator", role, commanded)


def behind(lateness: float, curvature: float) -> np.ndarray:
    """The signal behind a servo that was at rest before."""
    system = ([1.0], [curvature, lateness, 1.0] if curvature else [lateness, 1.0])
    return SIGNAL[0] + lsim(system, SIGNAL - SIGNAL[0], TIME)[1]


@pytest.mark.parametrize(("lateness", "curvature"), [(0.05, 0.0), (0.08, 0.0025)])
def test_a_control_follows_its_servo(lateness, curvature):
    record = FlightRecord(TIME, {"de": SIGNAL}, commanded=True)
    # a lag without a delay has no third coefficient
    third = -CUBIC * lateness * curvature
    values = {servo("lateness"): lateness, servo("curvature"): curvature, servo("third"): third}
    found = corrected(KESTREL, record, values)
    np.testing.assert_allclose(found["de"][50:-50], behind(lateness, curvature)[50:-50], atol=1e-4)


def test_the_servo_of_the_file_is_undone():
    file = replace(KESTREL, effects={"actuator_lag": {"elevator": UncertainValue(0.03)}})
    record = FlightRecord(TIME, {"de": behind(0.03, 0.0)}, commanded=True)
    found = corrected(file, record, {servo("lateness"): 0.07, servo("curvature"): 0.0})
    np.testing.assert_allclose(found["de"][50:-50], behind(0.07, 0.0)[50:-50], atol=1e-4)
    assert corrected(file, record, {servo("lateness"): 0.03})["de"] is record["de"]


def test_what_belongs_to_commands_does_not_move_measured_positions():
    record = FlightRecord(TIME, {"de": SIGNAL})
    assert corrected(KESTREL, record, {servo("lateness"): 0.07})["de"] is SIGNAL


def test_late_instruments_are_read_later():
    q = np.sin(3.0 * TIME)
    q[700] = np.nan
    record = FlightRecord(TIME, {"q": q, "alpha": np.cos(TIME), "de": SIGNAL})
    late = {Imperfection("delays.imu"): 0.013, Imperfection("delays.air_data"): 0.02}
    found = corrected(KESTREL, record, late | {Imperfection("air_data_lag.time_constant"): 0.03})
    inside = np.abs(TIME - 10.0) < 2.9
    np.testing.assert_allclose(found["q"][inside], np.sin(3.0 * (TIME[inside] + 0.013)), atol=1e-6)
    np.testing.assert_allclose(found["alpha"][inside], np.cos(TIME[inside] + 0.05), atol=1e-6)
    assert np.isnan(found["q"][700])
    assert found["de"] is SIGNAL
