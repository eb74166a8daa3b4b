"""What is allowed for is the same in all flights that are looked at together."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.model import UncertainValue
from sysid_node.gap.estimation.candidate_fit import linearised, stepped, unfitted
from sysid_node.gap.estimation.nuisances import HeldOutFlight, believed_effects, derivative_tolerances, nuisances_of
from sysid_node.gap.estimation.predictive_density import held_out_evidence
from sysid_node.gap.residuals.air_motion import is_gusty
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import Simulator


def test_calm_and_gusty_flights_are_judged_together(aircraft, plain_model) -> None:
    """Air that rises also turns: allowed for in both flights where it is in one, else their unknowns do not match."""
    blown = replace(plain_model, gusts=0.05 * plain_model.record["V"].mean())
    assert is_gusty(blown) and not is_gusty(plain_model)
    calm, rough = (nuisances_of(aircraft, model, (plain_model, blown)) for model in (plain_model, blown))
    assert calm.indices == rough.indices and len(calm.indices) > len(nuisances_of(aircraft, plain_model).indices)
    evidence = held_out_evidence(linearised(unfitted([plain_model], calm)), [HeldOutFlight(blown, rough)])
    assert np.isfinite(evidence.total)


def test_flights_without_lateral_instruments_are_judged_beside_others(aircraft, plain_model) -> None:
    alone = replace(plain_model, flight=replace(plain_model.flight, lateral=False))
    names = [nuisances_of(aircraft, model, (plain_model, alone)).indices for model in (plain_model, alone)]
    assert names[0] == names[1]
    assert len(nuisances_of(aircraft, alone).indices) < len(names[0])


def test_the_clock_of_a_slow_logs_commands_may_be_off_by_its_interval(aircraft, plain_model) -> None:
    """Between a log's commands stand lines at the model's rate, which do not tell when a step was."""
    slow = replace(plain_model, flight=replace(plain_model.flight, command_interval=0.1))
    clock = plain_model.simulator.names.index("actuator_stamp_delay.delay")
    for model, interval in ((plain_model, 0.01), (slow, 0.1)):
        found = nuisances_of(aircraft, model)
        place = found.indices.index(clock)
        assert (found.sigma[place], found.limit[place]) == pytest.approx((0.5 * interval, interval))


def test_flights_that_are_fitted_together_have_the_same_limits_in_any_order(aircraft, plain_model) -> None:
    """Those of the slowest messages, and of the flow angles that one of them did not measure."""
    other = replace(plain_model.flight, command_interval=0.1, air_rate=5.0, inferred=("alpha",))
    slow = replace(plain_model, flight=other)
    orders = ((plain_model, slow), (slow, plain_model))
    first, second = (nuisances_of(aircraft, one, fitted_with=[two]) for one, two in orders)
    assert first.indices == second.indices
    assert first.limit == pytest.approx(second.limit)
    limits = dict(zip((plain_model.simulator.names[i] for i in first.indices), first.limit, strict=True))
    assert limits["actuator_stamp_delay.delay"] == pytest.approx(0.1)
    assert limits["air_data_delay.delay"] == pytest.approx(0.2)
    assert limits["vane_bias.alpha"] == pytest.approx(THRESHOLDS.priors.limit * THRESHOLDS.priors.inferred_angle)


def test_a_simulators_file_is_right_within_a_small_share_unless_it_states_tolerances(aircraft) -> None:
    plain = {name: replace(d, tolerance=None) for name, d in aircraft.derivatives.items()}
    assert derivative_tolerances(replace(aircraft, derivatives=plain)) == {}
    found = derivative_tolerances(replace(aircraft, derivatives=plain, ideal=True))
    share = THRESHOLDS.priors.ideal
    assert found == {name: share * abs(d.value) for name, d in plain.items() if d.value}
    stated = {name: d.tolerance for name, d in aircraft.derivatives.items() if d.tolerance}
    assert derivative_tolerances(replace(aircraft, ideal=True)) == stated


def test_where_derivatives_are_the_cause_reality_may_be_further_off_a_simulators_file(aircraft, plain_model) -> None:
    """A file that holds its simulator to 2 % says nothing of how well the simulator agrees with reality."""
    plain = {name: replace(d, tolerance=None) for name, d in aircraft.derivatives.items()}
    simulators, names = replace(aircraft, derivatives=plain, ideal=True), plain_model.simulator.names
    found = nuisances_of(simulators, plain_model)
    place, priors = found.indices.index(names.index("derivative_error.Cm_alpha")), THRESHOLDS.priors
    size = abs(plain["Cm_alpha"].value)
    assert found.sigma[place] == pytest.approx(priors.ideal * size)
    assert found.factors[place] * found.sigma[place] == pytest.approx(priors.widening * priors.reality * size)
    stated = nuisances_of(aircraft, plain_model)
    assert set(stated.factors) == {priors.widening}


def stating(aircraft, **kind):
    """The aircraft with an effect of each kind among its file's."""
    effects = {
        "actuator_lag": {"elevator": UncertainValue(0.03, 0.006), "aileron": UncertainValue(0.05)},
        "actuator_rate_limit": {"elevator": UncertainValue(4.0, 0.5)},
        "mass_error": {"error": UncertainValue(0.1, 0.02)},
        "motor_lag": {"time_constant": UncertainValue(0.02, 0.02)},
        "control_effectiveness_loss": {"elevator": UncertainValue(0.3, 0.05), "onset": UncertainValue(4.0, 0.1)},
    }
    return replace(aircraft, effects=effects, **kind)


def test_a_stated_effect_is_a_nuisance_within_its_tolerance(aircraft, plain_model) -> None:
    simulator = Simulator(stating(aircraft), 50.0)
    found = nuisances_of(simulator.aircraft, replace(plain_model, simulator=simulator))
    sigma, limit = (
        dict(zip([simulator.names[i] for i in found.indices], x, strict=True)) for x in (found.sigma, found.limit)
    )
    shared = dict(zip([simulator.names[i] for i in found.indices], found.shared, strict=True))
    assert (sigma["actuator_lag.elevator"], limit["actuator_lag.elevator"]) == (0.006, pytest.approx(0.018))
    assert sigma["actuator_lag.aileron"] == pytest.approx(0.01)  # the default: a fifth
    assert sigma["actuator_rate_limit.elevator"] == pytest.approx(0.5 / 4.0**2)  # of the inverse
    assert (sigma["mass_error.error"], limit["mass_error.error"]) == (0.02, pytest.approx(0.06))
    assert limit["motor_lag.time_constant"] == pytest.approx(0.02)  # no time is negative
    assert sigma["control_effectiveness_loss.elevator"] == 0.05
    assert "control_effectiveness_loss.onset" not in sigma
    assert shared["mass_error.error"] and not shared["imu_bias.p"]


def test_an_ideal_file_has_no_nuisance_but_what_it_states(aircraft) -> None:
    found = believed_effects(Simulator(stating(aircraft, ideal=True), 50.0))
    assert "actuator_lag.aileron" not in found and found["actuator_lag.elevator"] == 0.006


def test_all_start_at_the_files_values(aircraft, plain_model) -> None:
    simulator = Simulator(stating(aircraft), 50.0)
    model = replace(plain_model, simulator=simulator)
    fit = unfitted([model], nuisances_of(simulator.aircraft, model))
    now, _, limit = fit.stacked
    np.testing.assert_array_equal(now, 0.0)
    np.testing.assert_array_equal(fit.flights[0].point, simulator.neutral())
    moved = stepped(fit, np.full(now.size, 1e3)).flights[0].point
    indices = list(fit.nuisances.indices)
    np.testing.assert_allclose(moved[indices], simulator.neutral()[indices] + limit[fit.nuisances.places(0)])


def test_a_bias_is_allowed_for_within_the_stated_bias_and_not_the_noise(aircraft, plain_model) -> None:
    stated = {"accel": 0.2, "gyro": 0.001, "airspeed": 0.3, "alpha": 0.02, "beta": 0.01}
    names = plain_model.simulator.names

    def sigma(known) -> dict[str, float]:
        found = nuisances_of(known, plain_model)
        return dict(zip([names[i] for i in found.indices], found.sigma.tolist(), strict=True))

    biases = sigma(replace(aircraft, noise_bias=stated))
    assert (biases["imu_bias.az"], biases["imu_bias.q"], biases["vane_bias.alpha"]) == (0.2, 0.001, 0.02)
    usual = sigma(aircraft)  # its file states none
    assert (usual["imu_bias.az"], usual["imu_bias.q"]) == (aircraft.noise["accel"], aircraft.noise["gyro"])
