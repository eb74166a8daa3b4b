"""Which effects may be to blame; truth: the simulator's list of effects, and what a flight can show."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.model import UncertainValue
from sysid_node.gap.estimation.candidates import PER_CONTROL, SECOND_ORDER, UNOBSERVABLE, Candidate, candidates_of
from sysid_node.gap.residuals.parameter_priors import bounds
from sysid_node.sim import EFFECTS, Simulator


@pytest.fixture(scope="module")
def candidates(plain_model) -> list[Candidate]:
    return candidates_of(plain_model.simulator, [plain_model])


def test_every_effect_that_a_flight_can_show_is_a_candidate(candidates) -> None:
    assert {c.effect for c in candidates} == EFFECTS.keys() - UNOBSERVABLE - {"ground_effect"}


def test_the_ground_is_a_candidate_where_the_file_says_how_far_it_is(plain_model) -> None:
    aircraft = plain_model.simulator.aircraft
    stated = {"lift": UncertainValue(0.2), "height": UncertainValue(2.0)}
    near = replace(aircraft, effects={"ground_effect": stated})
    model = replace(plain_model, simulator=Simulator(near, plain_model.simulator.rate))
    assert "ground_effect" in {c.effect for c in candidates_of(model.simulator, [model])}


def test_what_the_plane_of_symmetry_does_not_show_is_free_where_lateral_readings_were_measured(plain_model) -> None:
    """A bank without a turn would be a bias of the yaw rate: theta' = q cos(phi) - r sin(phi)."""
    flight = replace(plain_model.flight, lateral=False)
    in_plane, all_axes = (
        {c.label: {names[i] for i in c.indices} for c in candidates_of(plain_model.simulator, [model])}
        for names in [plain_model.simulator.names]
        for model in (replace(plain_model, flight=flight), plain_model)
    )
    assert in_plane["imu_bias"] == {"imu_bias.ax", "imu_bias.az", "imu_bias.q"}
    assert in_plane["cg_shift"] == {"cg_shift.x", "cg_shift.z"}
    assert in_plane["inertia_error"] == {"inertia_error.Iyy"}
    assert all_axes["imu_bias"] == in_plane["imu_bias"] | {"imu_bias.ay", "imu_bias.p", "imu_bias.r"}


def test_labels_are_unique(candidates) -> None:
    labels = [c.label for c in candidates]
    assert len(set(labels)) == len(labels)


def test_effects_with_an_onset_are_candidates_of_each_control(candidates, plain_model) -> None:
    controls = plain_model.simulator.layout.controls
    for effect in PER_CONTROL:
        assert [c.label for c in candidates if c.effect == effect] == [f"{effect} of {control}" for control in controls]


def test_lags_limits_and_delays_act_on_all_controls_on_one_or_on_each(candidates, plain_model) -> None:
    controls, names = plain_model.simulator.layout.controls, plain_model.simulator.names
    for effect in ("actuator_lag", "actuator_rate_limit", "actuator_backlash", "command_delay"):
        found = {
            c.label.partition(" of ")[2]: [names[i].partition(".")[2] for i in c.indices]
            for c in candidates
            if c.effect == effect
        }
        alone = {control: [control] for control in controls}
        second = {"second order": ["time_constant", "damping"]} if effect == "actuator_lag" else {}
        assert found == {"": [EFFECTS[effect].shared], **alone, "each control": list(controls), **second}


def test_a_lag_whose_damping_the_file_states_is_of_second_order_anyway(plain_model) -> None:
    stated = {"time_constant": UncertainValue(0.03), "damping": UncertainValue(0.7)}
    simulator = Simulator(
        replace(plain_model.simulator.aircraft, effects={"actuator_lag": stated}), plain_model.simulator.rate
    )
    found = candidates_of(simulator, [replace(plain_model, simulator=simulator)])
    assert SECOND_ORDER not in {candidate.label for candidate in found}


def test_derivatives_are_candidates_by_coefficient_and_one_alone(candidates, plain_model) -> None:
    names = plain_model.simulator.names
    found = {c.scope: c for c in candidates if c.effect == "derivative_error"}
    assert not any(c.indices for c in found.values())
    wide = {scope: [names[i].partition(".")[2] for i in c.widened] for scope, c in found.items()}
    assert wide["Cl"] == ["Cl_beta", "Cl_p", "Cl_r", "Cl_da", "Cl_dr"]
    assert {scope for scope in wide if scope.startswith("Cl_")} == {"Cl_beta", "Cl_p", "Cl_r"}
    assert wide["Cl_p"] == ["Cl_p"]
    assert (found["Cl"].choices, found["Cl_p"].choices) == (1, 3)  # one of three may be off, each as probably


def test_every_fit_starts_within_its_bounds_and_not_at_neutral(candidates, plain_model) -> None:
    simulator, neutral = plain_model.simulator, plain_model.simulator.neutral()
    for candidate in (c for c in candidates if c.indices):
        low, high = bounds(simulator, candidate.indices)
        for start in np.array(candidate.starts):
            inside = (low <= start) & (start <= high)
            onset = np.array([simulator.names[i].endswith(".onset") for i in candidate.indices])
            assert (inside | onset).all(), candidate.label
            assert (start != neutral[list(candidate.indices)]).any(), candidate.label


def test_what_was_not_measured_is_not_blamed(plain_model) -> None:
    flight = replace(plain_model.flight, metered=False)
    effects = {c.effect for c in candidates_of(plain_model.simulator, [replace(plain_model, flight=flight)])}
    assert not effects & {name for name, effect in EFFECTS.items() if effect.station == "propulsion"}
