"""Which screened candidates are fitted; truth: lists made by hand."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted, with_candidates
from sysid_node.gap.estimation.candidates import Candidate, candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.screening import Screened, ScreenedPair, best_screened, screened, with_found_starts
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import Simulator


def explanation() -> Any:
    """An explanation is known by itself alone here."""
    return SimpleNamespace()


def labelled(effect: str, control: str = "") -> Candidate:
    return Candidate(effect, f"{effect} of {control}" if control else effect, (0,), ((0.1,), (0.2,)))


def test_the_best_of_each_explanation_are_kept_at_most_two_of_one_effect() -> None:
    base, other = explanation(), explanation()
    surfaces = [labelled("stuck_surface", control) for control in ("elevator", "aileron", "rudder")]
    screened = [
        ScreenedPair(base, Screened(float(k), candidate, (0.1,)))
        for k, candidate in enumerate([*surfaces, labelled("cg_shift")])
    ]
    screened.append(ScreenedPair(other, Screened(9.0, labelled("mass_error"), (0.1,))))
    kept = best_screened(screened, 3)
    assert [pair.screened.candidate.label for pair in kept] == [
        "stuck_surface of elevator",
        "stuck_surface of aileron",
        "cg_shift",
        "mass_error",
    ]
    assert best_screened(screened, 1) == [screened[0], screened[-1]]


def test_of_the_wrong_derivatives_of_a_coefficient_the_likeliest_are_fitted() -> None:
    base = explanation()
    scopes = ("Cm_alpha", "Cm", "Cm_q", "Cn", "Cn_beta", "Cl")
    pairs = [ScreenedPair(base, Screened(float(k), labelled("derivative_error", s), ())) for k, s in enumerate(scopes)]
    kept = [pair.screened.candidate.scope for pair in best_screened(pairs, 6)]
    assert kept == ["Cm_alpha", "Cn"]  # of one effect no more than two


def test_costly_starts_that_were_found_are_the_only_ones_of_the_next_stage() -> None:
    stuck, shift, play = labelled("stuck_surface", "elevator"), labelled("cg_shift"), labelled("actuator_backlash")
    screened = [
        Screened(1.0, stuck, (0.3,)),
        Screened(2.0, shift, (0.4,)),
        Screened(3.0, stuck, (0.9,)),
        Screened(4.0, play, (0.5,)),
    ]  # the best first
    found = [c.starts for c in with_found_starts([stuck, shift, play], screened)]
    assert found == [((0.3,),), shift.starts, ((0.5,),)]


def test_wrong_derivatives_are_screened_with_the_slopes_at_hand(aircraft, plain) -> None:
    """Truth: the problem with their wider priors, linearised anew where the nuisance parameters are the file's."""
    model = residual_model_of(Simulator(aircraft, 50.0), plain)
    fit = converged(unfitted([model], nuisances_of(aircraft, model)), rounds=1)
    wrong = next(c for c in candidates_of(model.simulator, [model]) if c.label == "derivative_error of Cm")
    wider = with_candidates(fit, [wrong], fit.nuisances, ())
    deviance = VariableProjection(wider).deviance(wider.values)
    assert screened(fit, VariableProjection(fit), wrong).deviance == pytest.approx(deviance, abs=0.01)


def test_another_mass_is_seen_although_derivatives_have_gone_to_their_limits(aircraft, plain) -> None:
    """Truth: the aircraft is half as heavy again as its file says, and its file's derivatives are right."""
    light = replace(aircraft, mass=aircraft.mass / 1.5)
    model = residual_model_of(Simulator(light, 50.0), plain)
    fit = converged(unfitted([model], nuisances_of(light, model)), rounds=1)
    problem = VariableProjection(fit)
    assert not problem.free.all()  # some derivatives stand at their limits
    (mass,) = (c for c in candidates_of(model.simulator, [model]) if c.label == "mass_error")
    found = screened(fit, problem, mass)
    assert found.start[0] == pytest.approx(0.5, rel=0.3)
    assert found.deviance < problem.deviance(np.empty(0)) - 20.0
    assert found.prior_gain > THRESHOLDS.search.prior_gain  # the derivatives come back within their tolerances


def test_what_makes_the_derivatives_most_probable_is_fitted_although_it_removes_little() -> None:
    """As another mass does, for which all derivatives had made up."""
    base, least = explanation(), THRESHOLDS.search.prior_gain
    gains = {"stall_separation": 0.0, "imu_scale": 1.1 * least, "vane_scale": 0.0, "mass_error": 2.0 * least}

    def kept(share: float) -> list[str]:
        pairs = [
            ScreenedPair(base, Screened(float(k), labelled(name), (0.1,), share * gain))
            for k, (name, gain) in enumerate(gains.items())
        ]
        return [pair.screened.candidate.effect for pair in best_screened(pairs, 2)]

    assert kept(1.0) == ["stall_separation", "imu_scale", "mass_error"]
    assert kept(0.4) == ["stall_separation", "imu_scale"]  # of none it is enough


def test_a_bias_is_seen_although_derivatives_have_gone_to_their_limits(aircraft) -> None:
    """Truth: the vertical accelerometer reads 0.6 m/s^2 too much, and the file's narrow tolerances are kept."""
    sure = {name: replace(d, tolerance=0.1 * d.tolerance) for name, d in aircraft.derivatives.items()}
    file = replace(aircraft, derivatives=sure, noise_bias={**aircraft.noise_bias, "accel": 0.03})
    model = residual_model_of(Simulator(file, 50.0), fly(file, {"imu_bias": {"az": 0.6}}, seed=18))
    fit = converged(unfitted([model], nuisances_of(file, model)), rounds=1)
    problem = VariableProjection(fit)
    assert not problem.free.all()
    (bias,) = (c for c in candidates_of(model.simulator, [model]) if c.label == "imu_bias")
    found = screened(fit, problem, bias)
    az = [model.simulator.names[i] for i in bias.indices].index("imu_bias.az")
    assert found.start[az] == pytest.approx(0.6, rel=0.15)  # 0.44 with the derivatives at their limits
    assert found.deviance < problem.deviance(np.empty(0)) - 20.0


def test_a_wide_free_play_is_found_behind_the_minima_of_narrow_ones(loose) -> None:
    fitter, base, candidates = loose
    best = fitter.screen_upon([base], list(candidates.values()), lambda share, text: None)[0].screened
    assert best.candidate.label == "actuator_backlash of rudder"
    assert best.start == pytest.approx([0.08], rel=0.2)


def test_a_lag_of_second_order_takes_no_place_of_one_controls_lag() -> None:
    base = explanation()
    names = ("actuator_lag of second order", "actuator_lag of aileron", "actuator_lag", "actuator_lag of each control")
    lags = [Candidate("actuator_lag", n, (0,), ((0.1,),), law="second order" if "second" in n else "") for n in names]
    others = [labelled(effect) for effect in ("cg_shift", "mass_error")]
    pairs = [ScreenedPair(base, Screened(float(k), each, (0.1,))) for k, each in enumerate([*lags, *others])]
    kept = [pair.screened.candidate.label for pair in best_screened(pairs, 2)]
    assert kept == ["actuator_lag of second order", "actuator_lag of aileron", "actuator_lag", "cg_shift"]
