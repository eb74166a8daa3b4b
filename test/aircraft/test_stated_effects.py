"""What the estimators take of a file's effects, against the effects' equations in the simulator by hand."""

from dataclasses import replace

import pytest

from sysid_node.aircraft.effect_names import EFFECT_NAMES
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.aircraft.stated_effects import (
    as_estimated,
    not_taken_in_words,
    sizes_as_uncertainty,
    stated_cg,
    with_places_from_cg,
)

CDRW = load_aircraft("cdrw")


def stating(**effects: dict[str, UncertainValue]) -> Aircraft:
    return replace(CDRW, effects=effects)


def test_numbers_that_effects_change_are_those_of_the_simulator() -> None:
    """m (1 + error); Ixx (1 + error); Ixz + error sqrt(Ixx Izz); arms and the thrust's arm are added to."""
    arm = {"x": UncertainValue(0.1, 0.002), "z": UncertainValue(-0.02)}
    inertia = {"Ixx": UncertainValue(0.1, 0.05), "Ixz": UncertainValue(0.02)}
    file = stating(
        mass_error={"error": UncertainValue(-0.2, 0.01)},
        inertia_error=inertia,
        imu_lever_arm=arm,
        vane_lever_arm={"y": UncertainValue(0.3)},
        thrust_line_offset={"arm": UncertainValue(0.03, 0.001)},
        motor_lag={"time_constant": UncertainValue(0.1)},
    )
    found = as_estimated(file)
    assert found.mass == pytest.approx(0.8 * CDRW.mass)
    assert found.inertia.Ixx == pytest.approx(1.1 * CDRW.inertia.Ixx)
    assert found.inertia.Iyy == CDRW.inertia.Iyy
    size = (CDRW.inertia.Ixx * CDRW.inertia.Izz) ** 0.5
    assert found.inertia.Ixz == pytest.approx(CDRW.inertia.Ixz + 0.02 * size)
    assert found.sensors.imu == pytest.approx((0.15, 0.0, -0.03))
    assert found.sensors.air_data == pytest.approx((0.55, 0.3, 0.0))
    assert found.throttle is not None and found.throttle.arm == pytest.approx(0.03)
    assert found.effects.keys() == {"motor_lag"}
    sigma = found.tolerances
    assert sigma["mass"] == pytest.approx(0.01 * CDRW.mass)
    assert sigma["inertia.Ixx"] == pytest.approx(0.05 * CDRW.inertia.Ixx)
    assert (sigma["sensors.imu.x"], sigma["throttle.arm"]) == (0.002, 0.001)
    assert sigma["sensors.imu.z"] == CDRW.tolerances["sensors.imu.z"]
    assert as_estimated(found) is found
    assert as_estimated(CDRW) is CDRW


def test_places_count_from_the_stated_cg() -> None:
    """A CG further forward makes the arms to sensors before it shorter."""
    file = stating(cg_shift={"x": UncertainValue(0.03), "z": UncertainValue(-0.01)})
    assert stated_cg(file) == (0.03, 0.0, -0.01)
    found = with_places_from_cg(file)
    assert found.sensors.imu == pytest.approx((0.02, 0.0, 0.0))
    assert found.sensors.air_data == pytest.approx((0.52, 0.0, 0.01))
    assert with_places_from_cg(CDRW) is CDRW


def test_sizes_that_are_not_corrected_for_count_as_uncertainty() -> None:
    """The root of the sum of the squares of size and tolerance, in the unit of the tolerance that they widen."""
    file = stating(
        thrust_scale={"error": UncertainValue(0.03, 0.04)},
        actuator_bias={"rudder": UncertainValue(-0.02)},
        mass_error={"error": UncertainValue(0.1)},
    )
    assert sizes_as_uncertainty(file) == pytest.approx({"throttle.max_thrust": 1.5, "controls.rudder.offset": 0.02})
    assert sizes_as_uncertainty(CDRW) == {}
    assert sizes_as_uncertainty(replace(file, throttle=None)) == {"controls.rudder.offset": 0.02}


def test_what_is_not_taken_is_said_in_one_line() -> None:
    some = {"alpha": UncertainValue(0.1)}
    assert not_taken_in_words(CDRW) == ""
    assert not_taken_in_words(stating(vane_scale=some, cg_shift={"x": UncertainValue(0.02)})) == ""
    words = not_taken_in_words(
        stating(
            thrust_scale={"error": UncertainValue(0.03)},
            stall_separation={"depth": UncertainValue(1.0)},
            propwash={"gain": UncertainValue(0.0)},
            turbulence={"intensity": UncertainValue(1.0)},
        )
    )
    assert words == (
        "Of the aircraft file's effects the estimators do not correct for thrust_scale (the size counts as "
        "uncertainty), nor for stall_separation (derivatives and intervals are those of the model without)."
    )


@pytest.mark.parametrize("effect", EFFECT_NAMES)
def test_every_effect_is_taken_or_said_or_of_the_day(effect: str) -> None:
    taken = {
        *("command_delay", "actuator_lag", "actuator_rate_limit", "motor_lag", "imu_bias", "imu_scale"),
        *("imu_misalignment", "airspeed_scale", "vane_bias", "vane_scale", "imu_delay", "air_data_delay"),
        *("actuator_stamp_delay", "air_data_lag", "cg_shift", "mass_error", "inertia_error", "imu_lever_arm"),
        *("vane_lever_arm", "thrust_line_offset"),
    }
    of_the_day = {"steady_wind", "turbulence", "gust", "sensor_noise"}
    parameters = EFFECT_NAMES[effect].parameters(CDRW.controls, True, CDRW.derivatives)
    words = not_taken_in_words(stating(**{effect: {next(iter(parameters)): UncertainValue(0.1)}}))
    assert (effect in words) == (effect not in taken | of_the_day)
