"""The air's motion is told from the instruments' errors; truth: flights of this simulator."""

import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import is_gusty, nuisances_of
from sysid_node.gap.residuals.air_motion import gust_speed
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def late(aircraft):
    return residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"imu_delay": {"delay": 0.06}}, seed=21))


def test_a_late_imu_is_no_weather(late) -> None:
    assert gust_speed(late, late.simulator.neutral()) > 5.0 * late.gusts
    assert not is_gusty(late)


@pytest.mark.parametrize(
    ("effect", "parameter", "value"),
    [
        ("imu_bias", "q", 0.018),
        ("imu_bias", "az", 0.4),
        ("imu_lever_arm", "x", 0.15),
        ("imu_misalignment", "pitch", 0.05),
        ("vane_bias", "alpha", 0.03),
        ("vane_scale", "beta", 0.15),
        ("vane_lever_arm", "x", 0.3),
        ("airspeed_scale", "error", 0.1),
        ("air_data_lag", "time_constant", 0.08),
    ],
)
def test_still_air_is_still_with_one_instrument_off(aircraft, effect: str, parameter: str, value: float) -> None:
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {effect: {parameter: value}}, seed=31))
    assert not is_gusty(model)
    assert model.gusts < 0.004 * model.record["V"].mean()


def test_weather_is_no_instruments_error(aircraft) -> None:
    blown = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {}, seed=12, turbulence="light"))
    assert is_gusty(blown)
    assert blown.gusts > 0.5 * gust_speed(blown, blown.simulator.neutral())


@pytest.mark.parametrize(
    ("effect", "parameter", "value"), [("imu_delay", "delay", 0.06), ("air_data_lag", "time_constant", 0.15)]
)
def test_times_of_instruments_are_found(aircraft, late, effect, parameter, value) -> None:
    """Not short by what noise adds where readings are differentiated, nor by a clock that takes its share."""
    model = (
        late
        if effect == "imu_delay"
        else residual_model_of(late.simulator, fly(aircraft, {effect: {parameter: value}}, seed=22))
    )
    nuisances = nuisances_of(aircraft, model)
    candidates = [c for c in candidates_of(model.simulator, [model]) if c.effect == effect]
    found = converged(with_candidates(converged(unfitted([model], nuisances)), candidates, nuisances, [0.5 * value]))
    assert found.values[0] == pytest.approx(value, rel=0.04)
