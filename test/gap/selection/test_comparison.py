"""Scores of one explanation against another; truth: powers counted by hand, and the effect that was flown."""

from dataclasses import fields, replace

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.predictive_density import Evidence
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.acceptance import ComparisonTable, is_accepted
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.comparison import (
    Comparison,
    derivative_shift,
    power_left,
    probability_against,
    scores_in_gusts,
)
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.gap.short_flights.readings import READINGS
from sysid_node.sim import EFFECTS, Simulator


@pytest.fixture(scope="module")
def lag(aircraft) -> Comparison:
    """A servo's lag against nuisances alone, on a flight with that lag."""
    flight = fly(aircraft, {"actuator_lag": {"time_constant": 0.1}}, seed=14)
    model = residual_model_of(Simulator(aircraft, 50.0), flight)
    nuisances = nuisances_of(aircraft, model)
    fitter = CandidateFitter(nuisances, Checkpoint())
    base = fitter.fit_set(unfitted([model], nuisances), [])
    (candidate,) = (c for c in candidates_of(model.simulator, [model]) if c.label == "actuator_lag")
    return Comparison(base, base, fitter.add_candidate(base, candidate))


def test_the_true_effect_is_accepted_by_every_score(lag) -> None:
    assert lag.added.time == pytest.approx(0.1, rel=0.1)
    assert lag.added.sample_period == pytest.approx(0.01)
    assert lag.probability > 0.99 and lag.log_bayes_factor > 100.0
    assert lag.searched == len(EFFECTS) and lag.channels.in_gusts is None
    assert is_accepted(lag)


@pytest.mark.parametrize(("offset", "counted"), [(-0.008, 0.008), (0.008, 0.0)])
def test_early_stamps_of_the_commands_delay_the_response_beside_a_lag(lag, offset: float, counted: float) -> None:
    """Late stamps do the opposite."""
    fitted, clock = lag.fitted, lag.fitted.fit.simulator.names.index("actuator_stamp_delay.delay")
    (flight,) = fitted.fit.flights
    point = np.where(np.arange(flight.point.size) == clock, offset, flight.point)
    moved = replace(fitted, fit=replace(fitted.fit, flights=(replace(flight, point=point),)))
    assert Comparison(lag.base, lag.without, moved).added.by_clock == pytest.approx(counted)


@pytest.mark.parametrize(("shape", "gradual"), [({}, False), ({"alpha_star": 0.05}, True), ({"a1": 5.0}, True)])
def test_less_lift_at_all_angles_of_attack_is_no_stall(stalling, shape: dict[str, float], gradual: bool) -> None:
    """Truth: a stall at 0.17 rad; then the same with the least angle or abruptness of its range."""
    fitter, base, candidates = stalling
    fitted = fitter.add_candidate(base, candidates["stall_separation"])
    names = fitted.fit.simulator.names
    point = fitted.fit.flights[0].point.copy()
    point[[names.index(f"stall_separation.{name}") for name in shape]] = [*shape.values()]
    (flight,) = fitted.fit.flights
    moved = replace(fitted, fit=replace(fitted.fit, flights=(replace(flight, point=point),)))
    assert Comparison(base, base, moved).added.gradual is gradual


def test_a_free_play_counts_by_its_share_of_the_travel_of_its_control(loose) -> None:
    """Truth: the rudder goes 0.12 rad to either side; its free play was 0.08 rad."""
    fitter, base, candidates = loose
    alone, other = candidates["actuator_backlash of rudder"], candidates["imu_scale"]
    assert Comparison(base, base, fitter.add_candidate(base, alone)).added.play == pytest.approx(1.0 / 3.0, rel=0.1)
    assert Comparison(base, base, fitter.add_candidate(base, other)).added.play == 0.0


def test_the_table_decides_as_the_measured_scores_do(lag) -> None:
    table = lag.table()
    assert is_accepted(table)
    for entry in fields(ComparisonTable):
        assert getattr(table, entry.name) is getattr(lag, entry.name)


def test_powers_are_those_of_the_residuals(lag) -> None:
    """By hand: every line counts once, the mean by half; the motion is about the windows' means."""
    residual = lag.without.evidence.flights[0].residual
    power = np.abs(residual) ** 2
    np.testing.assert_allclose(power_left(lag.without.evidence), (power[:, 1:].sum(axis=1) + 0.5 * power[:, 0]).sum(0))
    whole = replace(lag.fitted.evidence, scores=np.zeros(8))
    divided = replace(lag, fitted=replace(lag.fitted, evidence=whole))
    np.testing.assert_allclose(divided.channels.power.without, power_left(lag.without.evidence))
    without, with_it = (
        (power[:, 1:].sum(axis=1) + 0.5 * power[:, 0]).sum(0)
        for power in (np.abs(each.fit.flights[0].residual) ** 2 for each in (lag.without, lag.fitted))
    )
    of_fits = 1.0 - with_it / without  # two groups: too short to be divided
    of_prediction = divided.channels.power.share_removed
    np.testing.assert_allclose(lag.channels.power.share_removed, np.maximum(of_fits, of_prediction))
    means = 0.5 * len(residual) * np.abs(residual[:, 0].mean(axis=0)) ** 2
    np.testing.assert_allclose(scores_in_gusts(lag.without, lag.fitted).mean_power.without, means)
    measured = lag.fitted.fit.models[0].measured
    np.testing.assert_allclose(lag.channels.motion, (np.abs(measured[:, 1:]) ** 2).sum(axis=(0, 1)))


def test_the_gap_that_comes_back_is_most_of_it(lag) -> None:
    """The only effect there is: without it, nuisances leave what they left before or more."""
    assert 0.5 < lag.channels.contribution.max() < np.inf


def test_what_cannot_be_predicted_without_the_effect_comes_back_without_end(lag) -> None:
    """Noise so unequal that the nuisances' normal equations are singular: no error of the diagnosis."""
    power = np.full_like(lag.without.fit.powers[0], 1e30)
    power[3, 0] = 1e-40
    endless = replace(lag.without, fit=lag.without.fit.with_powers([power]))
    assert np.isinf(Comparison(lag.base, endless, lag.fitted).channels.contribution).all()


def test_an_explanation_against_itself_is_even(lag) -> None:
    assert probability_against(lag.fitted, lag.fitted) == pytest.approx(0.5)
    assert probability_against(lag.without, lag.fitted) == pytest.approx(1.0 - lag.probability)


def shift_of(model, label: str, moved: dict[str, float]):
    """The shift of derivatives, each so many of the file's tolerances off, that a flight determines to a thousandth."""
    nuisances = nuisances_of(model.simulator.aircraft, model)
    chosen = [c for c in candidates_of(model.simulator, [model]) if c.label == label]
    fit = with_candidates(unfitted([model], nuisances), chosen, nuisances, ())
    point = fit.flights[0].point.copy()
    for name, tolerances in moved.items():
        index = model.simulator.names.index(f"derivative_error.{name}")
        point[index] += tolerances * nuisances.sigma[nuisances.indices.index(index)]
    return derivative_shift(replace(fit.at([point]), information=1e6 * fit.prior_information))


@pytest.mark.parametrize(
    ("label", "squares", "log_widening"),
    [
        ("", 36.0, 0.0),
        ("derivative_error of Cm_alpha", 36.0 / 25.0, np.log(5.0) + np.log(2.0)),  # or else Cm_q, as probably
        ("derivative_error of Cm", 36.0 / 25.0, 4.0 * np.log(5.0)),
    ],
)
def test_the_joint_prior_of_derivatives_counts_how_wide_a_candidate_makes_it(
    plain_model, label: str, squares: float, log_widening: float
) -> None:
    """Truth: normal densities by hand, priors five times as wide; the squares' mean is the number that are known."""
    known = sum(d.tolerance is not None for d in plain_model.simulator.aircraft.derivatives.values())
    found = shift_of(plain_model, label, {"Cm_alpha": 6.0, "CL_alpha": -1.0})
    assert found.distance == pytest.approx(squares + 1.0)
    assert found.expected == pytest.approx(known, rel=1e-4)
    assert found.log_widening == pytest.approx(log_widening)


@pytest.mark.parametrize(("stated", "beyond"), [({"accel": 0.03, "gyro": 0.001}, 8.0), ({}, 0.0)])
def test_a_bias_is_counted_beyond_its_error_in_what_the_file_states_of_it(
    plain_model, stated: dict[str, float], beyond: float
) -> None:
    """Truth: 0.3 m/s^2, known to 0.03, are eight times the stated 0.03 beyond two standard errors."""
    aircraft = plain_model.simulator.aircraft
    known = replace(aircraft, noise_bias={**aircraft.noise_bias, **stated})
    model = replace(plain_model, simulator=Simulator(known, 50.0))
    nuisances = nuisances_of(known, model)
    (bias,) = (c for c in candidates_of(model.simulator, [model]) if c.label == "imu_bias")
    fit = with_candidates(unfitted([model], nuisances), [bias], nuisances, [0.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    fit = replace(fit, information=np.diag(np.full(fit.prior_information.shape[0], 0.03**-2)))
    added = FittedSet(fit, Evidence(np.zeros(1), ()), bias)
    assert Comparison(added, added, added).added.bias == pytest.approx(beyond)


def test_short_flights_show_what_a_lag_does_to_the_rates(lag) -> None:
    rates = [READINGS.index(name) for name in ("p", "r")]
    assert (lag.readings.errors.share_removed[rates] > 0.5).all()
    assert (lag.readings.errors.removed[rates] > 0.01 * lag.readings.motion[rates]).all()
    assert np.isfinite(lag.readings.motion[rates]).all() and not lag.readings.simulator_error.any()
