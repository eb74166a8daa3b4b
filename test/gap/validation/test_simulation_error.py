"""Short flights beside a flight: with nothing wrong the noise floor is left, whatever the effect and the air."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.estimation.predictive_density import Evidence, FlightEvidence
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.validation.simulation_error import side_by_side, simulation_gap, weather_suffices
from sysid_node.sim import Simulator

#: Of each kind: in the actuators, in a sensor that sets the states anew, in a clock.
EFFECTS: dict[str, dict[str, dict[str, float]]] = {
    "still air": {"actuator_lag": {"time_constant": 0.12}},
    "sensor": {"airspeed_scale": {"error": 0.1}},
    "clock": {"air_data_delay": {"delay": 0.1}},
}


def evidence(model: ResidualModel, theta) -> Evidence:
    return Evidence(np.empty(0), (FlightEvidence.throughout(model, theta),))


def gap_of(model: ResidualModel, effects: Mapping[str, Mapping[str, float]]):
    """Before: the file; after: with the effects."""
    simulator = model.simulator
    return simulation_gap(evidence(model, simulator.neutral()), evidence(model, simulator.vector(effects)))


@pytest.mark.parametrize("kind", EFFECTS)
def test_the_true_effect_leaves_the_noise_floor(aircraft, make_flight, kind) -> None:
    model = residual_model_of(Simulator(aircraft, 50.0), make_flight(EFFECTS[kind], seed=3))
    gap = gap_of(model, EFFECTS[kind])
    assert gap.before > 4.0 * gap.noise_floor
    assert gap.after == pytest.approx(gap.noise_floor, rel=0.15) and gap.noise_floor < 0.15
    assert gap.shrink_percent == pytest.approx(100.0, abs=3.0)


def test_gusts_are_no_gap(aircraft, make_flight) -> None:
    """Light turbulence, nothing wrong: what it leaves is foretold by how much the air moved."""
    model = residual_model_of(Simulator(aircraft, 50.0), make_flight({}, seed=4, turbulence="light"))
    gap = gap_of(model, {})
    assert gap.before == pytest.approx(gap.noise_floor, rel=0.3)
    assert gap.intervals["before"][0] < gap.before < gap.intervals["before"][1]
    assert gap.shrink_percent == 0.0


def test_short_flights_begin_where_the_flight_is(plain_model) -> None:
    """The simulator reads what was measured at the start of each, and departs from it later."""
    beside = side_by_side(plain_model, [plain_model.simulator.vector({"mass_error": {"error": 0.3}})])
    begins = np.flatnonzero(beside.begins)
    assert np.diff(begins) == pytest.approx(2.0 * plain_model.simulator.rate)
    off = np.abs(beside.measured - beside.before)[:, 9]
    np.testing.assert_allclose(off[begins], 0.0, atol=1e-9)
    assert off.max() > 0.05


def test_no_attitude_no_short_flights(plain_model) -> None:
    columns = {n: v for n, v in plain_model.record.columns.items() if n not in ("phi", "theta")}
    record = replace(plain_model.record, columns=columns)
    bare = replace(plain_model, measurement=replace(plain_model.measurement, record=record))
    assert gap_of(bare, {}) is None


def test_weather_is_foreseen_and_effects_are_not(aircraft, make_flight) -> None:
    """Turbulence in which nothing but the autopilot moves the surfaces, and a wing that rings in still air."""
    simulator = Simulator(aircraft, 50.0)
    weather = make_flight({}, seed=5, turbulence="light", manoeuvre=[])
    assert weather_suffices([residual_model_of(simulator, weather)])
    slow = make_flight({"structural_mode": {"gain": 0.3}}, seed=6)
    assert not weather_suffices([residual_model_of(simulator, slow)])


@pytest.mark.slow
def test_a_flight_in_gusts_does_not_hide_what_a_calm_one_shows(aircraft, make_flight) -> None:
    """Servos of 30 ms in severe turbulence and in still air: weather covers them in the first flight only."""
    simulator, slow = Simulator(aircraft, 50.0), {"actuator_lag": {"time_constant": 0.03}}
    flights = (make_flight(slow, seed=7, turbulence="severe"), make_flight(slow, seed=8))
    gusty, calm = (residual_model_of(simulator, flight) for flight in flights)
    assert weather_suffices([gusty])
    assert not weather_suffices([gusty, calm])
