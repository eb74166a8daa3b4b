"""About which values imperfections lie, by the aircraft file. Truth: the normal distribution, cut off below zero."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plant import made_aircraft
from scipy.stats import truncnorm

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.online.frequency.regression_signals import layout
from sysid_node.online.systematic.estimation import to_take_out
from sysid_node.online.systematic.imperfections import imperfections
from sysid_node.online.systematic.sources import ErrorSource, sources

CDRW = load_aircraft("cdrw")


def source(aircraft: Aircraft, key: str) -> ErrorSource:
    return next(one for one in sources(aircraft) if one.key == key)


def stating(**effects: dict[str, UncertainValue]) -> Aircraft:
    return replace(CDRW, effects=effects)


def test_a_silent_file_expects_none_but_what_is_late() -> None:
    late = {"air_data_lag.time_constant", "delays.imu"}
    assert {one.key for one in sources(CDRW) if one.expected != 0.0} == late
    assert all(one.stated == 0.0 for one in sources(CDRW))


def test_lag_and_centre_of_gravity_lie_about_what_the_file_states() -> None:
    lag, shift = UncertainValue(0.05, 0.02), UncertainValue(-0.03, 0.004)
    file = stating(air_data_lag={"time_constant": lag}, cg_shift={"x": shift})
    cut = truncnorm(-2.5, np.inf, 0.05, 0.02)
    found = source(file, "air_data_lag.time_constant")
    assert (found.expected, found.sigma) == pytest.approx((cut.mean(), cut.std()))
    assert found.stated == 0.05
    assert source(file, "cg_shift.x") == ErrorSource("cg_shift.x", 0.004, -0.03, -0.03)
    assert source(file, "cg_shift.z") == source(CDRW, "cg_shift.z")


def test_what_the_alignment_takes_out_is_expected_to_be_gone() -> None:
    """The remaining error has the stated tolerance about zero, however a delay is stated."""
    file = stating(
        airspeed_scale={"error": UncertainValue(0.1, 0.005)}, imu_delay={"delay": UncertainValue(0.02, 0.001)}
    )
    assert source(file, "airspeed_scale.error") == ErrorSource("airspeed_scale.error", 0.005)
    as_delay = replace(CDRW, delays={**CDRW.delays, "imu": UncertainValue(0.02, 0.001)})
    for aircraft in (file, as_delay):
        found = source(aircraft, "delays.imu")
        assert (found.expected, found.sigma, found.stated) == (pytest.approx(0.0), pytest.approx(0.001), 0.0)


def test_an_exact_value_is_taken_out_too() -> None:
    """Of a file that is ideal and states no tolerance; a source without any uncertainty would be left out."""
    ideal = made_aircraft(effects={"air_data_lag": {"time_constant": UncertainValue(0.06)}})
    found = source(ideal, "air_data_lag.time_constant")
    assert (found.expected, found.stated) == (0.06, 0.06)
    assert 0.0 < found.sigma <= 1e-4


def test_sizes_that_are_not_corrected_for_widen_their_sources() -> None:
    file = stating(thrust_scale={"error": UncertainValue(0.2)})
    assert source(file, "throttle.max_thrust").sigma == pytest.approx(np.hypot(0.2 * 30.0, 0.1 * 30.0))


def test_the_first_look_begins_at_the_stated_values() -> None:
    file = stating(air_data_lag={"time_constant": UncertainValue(0.05)}, cg_shift={"z": UncertainValue(0.01)})
    found = imperfections(file, layout(file), commanded=True, positions=False)
    assert found is not None
    taken_out = dict(zip(found.keys, to_take_out(found, found.applied, None), strict=False))
    stated = {"air_data_lag.time_constant": 0.05, "cg_shift.z": 0.01}
    assert {key: value for key, value in taken_out.items() if value} == stated


@pytest.mark.parametrize(("estimate", "taken"), [(-0.031, -0.031), (-0.06, -0.036), (0.0, -0.024)])
def test_what_is_taken_out_is_bounded_about_the_expected_value(estimate: float, taken: float) -> None:
    """Six tolerances of 1 mm about a CG that the file has 30 mm aft; about zero it could not be taken out at all."""
    file = stating(cg_shift={"x": UncertainValue(-0.03, 0.001)})
    found = imperfections(file, layout(file), commanded=True, positions=True)
    assert found is not None
    place, estimates = found.keys.index("cg_shift.x"), np.zeros(len(found.keys))
    estimates[place] = estimate
    last: Any = SimpleNamespace(
        servos=found.applied, lines=found.applied, considered=SimpleNamespace(estimate=estimates)
    )
    assert to_take_out(found, found.applied, last)[place] == pytest.approx(taken)
