"""Flights on which nobody metered the thrust; truth: the thrust that was taken away.

``test_flow_angles`` diagnoses such a flight, which has no vanes either.
"""

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import whole

from sysid_node.aircraft.model import LookupTable
from sysid_node.errors import InputError
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.sim import Simulator


def without_thrust(aircraft, flight: GapFlight) -> GapFlight:
    """The flight as it is recorded where nobody meters the engine."""
    columns = {**flight.record.columns, "thrust": np.full(len(flight.record), np.nan)}
    return whole(aircraft, replace(flight, record=replace(flight.record, columns=columns)))


def test_thrust_is_what_the_files_drag_leaves(aircraft, plain) -> None:
    """Of the same aircraft, over a second: what is left is noise and the accelerometer's arm."""
    flight = without_thrust(aircraft, plain)
    assert not flight.metered and plain.metered
    window = np.hanning(round(2.0 / np.median(np.diff(plain.record.time))))
    found, true = (np.convolve(f.record["thrust"], window / window.sum(), "valid") for f in (flight, plain))
    assert found.mean() == pytest.approx(true.mean(), rel=0.02)
    assert (found - true).std() < 0.5 * true.std()


@pytest.mark.slow
def test_forward_motion_is_not_compared(aircraft, plain) -> None:
    model = residual_model_of(Simulator(aircraft, 50.0), without_thrust(aircraft, plain))
    assert {c for c, measured in zip(CHANNELS, model.axes, strict=True) if not measured} == {"CD"}
    effects = {c.effect for c in candidates_of(model.simulator, [model])}
    assert not {"thrust_scale", "motor_lag", "thrust_line_offset", "thrust_yaw", "propwash"} & effects
    assert {"actuator_lag", "command_delay", "cg_shift"} <= effects


def test_a_thrust_that_most_samples_lack_is_refused(aircraft, plain) -> None:
    thrust = plain.record["thrust"].copy()
    thrust[: 2 * thrust.size // 3] = np.nan
    holed = replace(plain.record, columns={**plain.record.columns, "thrust": thrust})
    with pytest.raises(InputError, match="no complete thrust"):
        whole(aircraft, replace(plain, record=holed))


def test_drag_in_a_table_counts_as_drag_in_a_derivative(aircraft, plain) -> None:
    """Truth: a table that adds the same at every angle is a constant."""
    drag = aircraft.derivatives["CD_0"]
    table = LookupTable("CD", ("alpha",), ((-1.0, 1.0),), (drag.value, drag.value))
    tabulated = replace(
        aircraft, derivatives={**aircraft.derivatives, "CD_0": replace(drag, value=0.0)}, tables=(table,)
    )
    found, same = (without_thrust(one, plain).record["thrust"] for one in (tabulated, aircraft))
    np.testing.assert_allclose(found, same, atol=1e-9)
