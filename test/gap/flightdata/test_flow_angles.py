"""Flights without vanes: flow angles inferred from the inertial instruments; truth: the vanes that were taken away."""

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import whole

from sysid_node.errors import InputError
from sysid_node.gap.diagnose import diagnose
from sysid_node.gap.document import document
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.gap.short_flights.multiple_shooting import course_of, simulation_error
from sysid_node.gap.validation.noise_floor import noise_floor_errors
from sysid_node.report.sections.gap.paragraph import paragraph
from sysid_node.sim import Simulator


def blind(aircraft, flight: GapFlight, *lost: str) -> GapFlight:
    """The flight as an aircraft without these instruments has it."""
    columns = {**flight.record.columns, **{name: np.full(len(flight.record), np.nan) for name in lost}}
    return whole(aircraft, replace(flight, record=replace(flight.record, columns=columns)))


@pytest.fixture(scope="module")
def vaneless(aircraft, plain) -> GapFlight:
    return blind(aircraft, plain, "alpha", "beta")


@pytest.fixture(scope="module")
def vaneless_model(aircraft, vaneless):
    return residual_model_of(Simulator(aircraft, 50.0), vaneless)


def test_angles_are_those_that_the_vanes_read(plain, vaneless) -> None:
    assert vaneless.inferred == ("alpha", "beta")
    for angle in vaneless.inferred:
        error, moved = vaneless.record[angle] - plain.record[angle], plain.record[angle].std()
        assert np.sqrt((error**2).mean()) < 0.006 < moved / 2.0


def test_one_vane_is_used_where_it_is_there(aircraft, plain) -> None:
    flight = blind(aircraft, plain, "beta")
    assert flight.inferred == ("beta",)
    np.testing.assert_array_equal(flight.record["alpha"], plain.record["alpha"])


@pytest.mark.slow
def test_what_was_not_measured_is_not_compared(vaneless_model) -> None:
    assert {c for c, measured in zip(CHANNELS, vaneless_model.axes, strict=True) if not measured} == {"alpha", "beta"}
    effects = {c.effect for c in candidates_of(vaneless_model.simulator, [vaneless_model])}
    assert not {"vane_bias", "vane_scale", "vane_lever_arm", "air_data_lag", "air_data_delay", "imu_delay"} & effects
    assert {"actuator_lag", "command_delay", "cg_shift"} <= effects


@pytest.mark.slow
def test_only_noise_is_left_of_the_same_aircraft(vaneless_model) -> None:
    model = vaneless_model
    residual = np.abs(model.residual(model.simulator.neutral())[:, 1:]) ** 2
    ratio = (residual.mean(axis=0).sum(axis=0) / model.noise[1:].sum(axis=0))[model.axes]
    assert (ratio < 8.0).all(), ratio


@pytest.mark.slow
def test_still_air_is_known_to_be_still(vaneless_model) -> None:
    assert vaneless_model.gusts < 0.01 * vaneless_model.record["V"].mean()


@pytest.mark.slow
def test_a_late_imu_cannot_be_told_from_late_commands_without_vanes(aircraft, make_flight) -> None:
    """Nobody metered the thrust either, so that forward motion is left out."""
    flights = [
        blind(aircraft, make_flight({"imu_delay": {"delay": 0.06}}, seed=s), "alpha", "beta", "thrust") for s in (5, 6)
    ]
    found = diagnose(aircraft, flights[:1], flights[1:])
    (cause,) = document(found)["causes"]
    assert found.verdict == "ambiguous"
    assert (cause["effect"], cause["indistinguishable_from"]) == ("command_delay", ["imu_delay"])
    assert cause["parameters"]["elevator"][0] == pytest.approx(0.06, rel=0.1)
    assert cause["probability"] == pytest.approx(0.5, abs=0.05)
    assert not {"alpha", "beta", "ax", "V"} & found.size.per_channel.keys()
    assert "or imu delay)" in paragraph(found)
    assert "Thrust was not recorded" in paragraph(found)


@pytest.mark.slow
def test_tolerances_are_no_gap_without_vanes(aircraft, make_flight) -> None:
    """A lift slope that is off makes the mean angle of attack wrong, and with it the drag."""
    wrong = {"Cm_alpha": 0.015, "Cm_de": 0.04, "CL_alpha": -0.2, "CL_0": 0.02, "Cl_p": 0.03, "Cn_beta": 0.006}
    flight = blind(aircraft, make_flight({"derivative_error": wrong}, seed=7), "alpha", "beta")
    assert diagnose(aircraft, [flight], []).verdict == "no_gap"


def test_what_cannot_be_inferred_is_said(aircraft, plain) -> None:
    with pytest.raises(InputError, match=r"no complete alpha; the gap cannot be measured without"):
        blind(aircraft, plain, "alpha", "beta", "ay")
    derivatives = {name: d for name, d in aircraft.derivatives.items() if name != "CL_alpha"}
    with pytest.raises(
        InputError, match=r"no alpha or beta; they can be inferred where the aircraft file has CL_alpha"
    ):
        blind(replace(aircraft, derivatives=derivatives), plain, "alpha", "beta")


def test_readings_before_the_flight_are_said(aircraft, plain) -> None:
    """The filter begins where air flows: standing still the aircraft has no angle of attack."""
    standing = np.where(plain.record.time < 1.0, 0.1, plain.record["V"])
    flight = replace(plain, record=replace(plain.record, columns={**plain.record.columns, "V": standing}))
    with pytest.raises(InputError, match=r"no complete alpha; the gap cannot be measured without"):
        blind(aircraft, flight, "alpha", "beta")


@pytest.mark.slow
def test_the_floor_without_vanes_knows_of_gusts(aircraft, make_flight) -> None:
    """What no vane shows is no error of the simulator; in still air there is nothing that it could not see."""
    floors = []
    for turbulence in ("none", "light"):
        flight = blind(aircraft, make_flight({}, seed=3, turbulence=turbulence), "alpha", "beta")
        model = residual_model_of(Simulator(aircraft, 50.0), flight)
        course = course_of(model, 100)
        error, _ = next(noise_floor_errors(model, model.simulator.neutral(), course))
        mine = simulation_error(model, model.simulator.neutral(), course)
        floors.append((np.sqrt((error[:, 4] ** 2).mean()), np.sqrt((mine[:, 4] ** 2).mean())))
    (calm, calm_flown), (rough, rough_flown) = floors
    assert rough > 3.0 * calm and rough_flown > 3.0 * calm_flown
    assert 0.4 < rough / rough_flown < 2.5
