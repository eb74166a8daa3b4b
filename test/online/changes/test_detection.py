"""Abrupt changes: announced soon where there is one and never where there is none. Truth: simulated flights."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import TRUTH, exact_flight, fly, made_aircraft, multisteps

from sysid_node.aircraft.model import UncertainValue
from sysid_node.online import estimator
from sysid_node.online.changes.detection import (
    KNOWN,
    SIGNIFICANCE,
    SPANS,
    ChangeMonitor,
    ChangeTests,
    compare,
    fits_worse,
)
from sysid_node.online.changes.excited_segments import estimates_of, no_excited_segments, remember
from sysid_node.online.changes.score_test import ReferenceEstimates
from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression import normal_equations
from sysid_node.online.regression.information import BANDS, nothing
from sysid_node.online.regression.least_squares import Solution, Uncertainty
from sysid_node.online.renewal.servo_steps import move_servos
from sysid_node.online.replay import run
from sysid_node.online.settings import METHODS, OnlineSettings
from sysid_node.online.state import EstimatorState, completed
from sysid_node.online.types import Estimates

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft()
ELEVATOR = ("CL_de", "CD_de", "Cm_de")
RATE, LOST_AT = 100.0, 30.0
MOMENTS = np.arange(5.0, LOST_AT + 4.5, 0.5)  # s, at which the estimates are looked at
EQUATIONS = normal_equations.normal_equations({"Cm": ("0", "alpha", "de")}, SignalLayout(("alpha", "de"), ("de",), ()))


def announced(history: list[Estimates]) -> list[float]:
    """Times at which a change was being announced."""
    return [e.time for e in history if any(d.status == "changed" for d in e.derivatives.values())]


@cache
def with_half_the_elevator(gusts: float, closed_loop: bool) -> tuple[Array, Array]:
    """Three flights, flown once for both methods."""
    after = (LOST_AT, dict.fromkeys(ELEVATOR, 0.5))
    commands = multisteps(LOST_AT + 4.5, RATE, seed=6)
    return fly(AIRCRAFT, commands, RATE, 3, seed=3, gusts=gusts, closed_loop=closed_loop, after=after)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gusts", "closed_loop", "method"),
    [
        (0.0, False, "iv_rft"),
        (1.5, True, "iv_rft"),
        (0.7, True, "sls_rft"),
    ],
)
def test_half_the_elevator_is_lost(gusts: float, closed_loop: bool, method: str) -> None:
    """Half its effectiveness gone at 30 s: announced by 34 s in every flight, Cm_de then right in 15 %."""
    time, flights = with_half_the_elevator(gusts, closed_loop)
    for samples in flights:
        history = run(AIRCRAFT, OnlineSettings(method=method), time, samples, MOMENTS)
        times = announced(history)
        assert times and LOST_AT < times[0] <= LOST_AT + 4.0
        later = next(e for e in history if e.time >= LOST_AT + 4.0).derivatives["Cm_de"]
        assert later.value == pytest.approx(0.5 * TRUTH["Cm_de"], rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize(("gusts", "method"), [(1.5, "iv_rft"), (0.7, "sls_rft")])
def test_servos_of_unknown_time_do_not_hide_that_half_the_elevator_is_lost(gusts: float, method: str) -> None:
    """The servos' estimated times move with most renewals: announced by 34 s in every flight all the same."""
    time, flights = with_half_the_elevator(gusts, True)
    silent = replace(AIRCRAFT, ideal=False)
    for samples in flights[:2]:
        times = announced(run(silent, OnlineSettings(method=method), time, samples, MOMENTS))
        assert times and LOST_AT < times[0] <= LOST_AT + 4.0


def known(time: float, theta: float) -> ReferenceEstimates:
    """Estimates at a time (s), all of them ``theta``."""
    C, P = EQUATIONS.outputs.size, EQUATIONS.columns.size
    solution = Solution(np.full((P, C), theta), np.eye(P), np.ones(C), np.ones(C), True)
    return ReferenceEstimates(
        time, EQUATIONS, solution, Uncertainty(np.zeros((C, P, P)), np.ones(C), np.ones((C, BANDS)), np.ones(C))
    )


def thetas(monitor: ChangeMonitor) -> list[tuple[float, float]]:
    """Time (s) and value of each reference."""
    return [(one.time, float(one.solution.theta[0, 0])) for one in monitor.references]


def test_the_present_estimates_take_the_place_of_those_made_of_the_same_flight_before() -> None:
    monitor = ChangeMonitor()
    for time, theta in ((1.0, 1.0), (2.0, 2.0), (2.0, 5.0), (3.0, 4.0)):
        monitor.add_reference(known(time, theta))
    assert thetas(monitor) == [(1.0, 1.0), (2.0, 5.0), (3.0, 4.0)]


def with_lag_not_known() -> EstimatorState:
    """The estimator after 14 s with servos of whose lag the file says little."""
    lags = {"actuator_lag": {name: UncertainValue(0.05, 0.02) for name in AIRCRAFT.controls}}
    time, flights = fly(AIRCRAFT, multisteps(14.0, RATE), RATE, 1)
    state = estimator.init(replace(AIRCRAFT, ideal=False, effects=lags), OnlineSettings(actuators="auto"))
    for moment, sample in zip(time.tolist(), flights[0].tolist(), strict=True):
        estimator.update(state, moment, sample)
    estimator.complete(state)
    return state


def statistics(state: EstimatorState) -> list[Array]:
    """The statistics (C,) of all stretches, with the controls where the servos have them at present."""
    model, monitor = state.model, state.changes.monitor
    tests = ChangeTests(
        model.equations, state.controls.line_model, model.spectrum, monitor, state.transform.last, math.inf
    )
    return [found.statistic for _, found in tests.contradictions(SPANS)]


def test_estimates_are_tested_with_the_servos_with_which_they_were_made() -> None:
    """Otherwise a change that shows while a servo's estimated time moves would not be seen."""
    state = with_lag_not_known()
    before, line_model, servos = statistics(state), state.controls.line_model, state.controls.servos
    assert len(before) == len(SPANS)
    assert servos is not None
    completed(move_servos(state, servos.moved(np.full(servos.lateness.size, 0.04), np.zeros(servos.lateness.size))))
    assert state.controls.line_model is not line_model
    np.testing.assert_array_equal(statistics(state), before)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changed", "key"),
    [
        ({"CY_da": 0.5, "Cl_da": 0.5, "Cn_da": 0.5}, "Cl_da"),
        (dict.fromkeys(ELEVATOR, 0.8), "Cm_de"),
        ({"Cm_alpha": 0.6}, "Cm_alpha"),
        (dict.fromkeys(("CL_alpha", "CL_de", "Cm_alpha", "Cm_de", "Cl_p", "Cl_da", "Cl_beta", "Cn_r"), 0.8), "Cm_de"),
    ],
    ids=["aileron", "elevator, a fifth", "centre of gravity", "icing"],
)
def test_no_estimate_is_valid_and_far_off_once_a_change_has_shown(changed: dict[str, float], key: str) -> None:
    """Noticed or not: from 36 s on under 2 % of the valid estimates of the changed derivative are > 4 s.e. off."""
    after = (LOST_AT, changed)
    time, flights = fly(AIRCRAFT, multisteps(42.0, RATE, seed=6), RATE, 2, seed=3, gusts=0.7, after=after)
    truth = TRUTH[key] * changed[key]
    histories = [run(AIRCRAFT, OnlineSettings(), time, samples, np.arange(36.0, 42.0, 0.25)) for samples in flights]
    valid = [d for history in histories for d in (e.derivatives[key] for e in history) if d.valid]
    far = [d for d in valid if abs(d.value - truth) > 4.0 * d.standard_error]
    assert len(far) <= 0.02 * len(valid)


def test_estimates_of_quiet_flight_are_learned_anew_without_a_change_being_announced() -> None:
    """Still air, only the autopilot's answers to its sensors' noise, then the first manoeuvre: it may contradict."""
    commands = multisteps(30.0, RATE)
    commands[: round(20.0 * RATE)] = 0.0
    time, flights = fly(AIRCRAFT, commands, RATE, 2, seed=7, gusts=0.3)
    for samples in flights:
        history = run(AIRCRAFT, OnlineSettings(), time, samples, np.arange(5.0, 30.0, 0.5))
        assert announced(history) == []
        assert history[-1].derivatives["Cm_de"].valid
        assert history[-1].derivatives["Cm_de"].value == pytest.approx(TRUTH["Cm_de"], rel=0.1)


@pytest.mark.slow
def test_what_a_change_leaves_behind_is_forgotten() -> None:
    """Ten seconds later nothing of the old aircraft is in the estimates; without detection it still is."""
    after = (LOST_AT, dict.fromkeys(ELEVATOR, 0.5))
    time, flights = fly(AIRCRAFT, multisteps(LOST_AT + 12.0, RATE), RATE, 1, seed=5, gusts=0.7, after=after)
    watched, blind = (
        run(AIRCRAFT, OnlineSettings(method="sls_rft", detect_changes=detect), time, flights[0], time[-1:])[
            0
        ].derivatives
        for detect in (True, False)
    )
    assert watched["Cm_de"].value == pytest.approx(0.5 * TRUTH["Cm_de"], rel=0.05)
    assert blind["Cm_de"].value != pytest.approx(0.5 * TRUTH["Cm_de"], rel=0.15)
    assert watched["Cl_da"].value == pytest.approx(TRUTH["Cl_da"], rel=0.1)


def test_a_memory_that_fades_forgets_a_change_as_well() -> None:
    """Three seconds after the elevator's loss the lines hold the new aircraft alone: one model explains them."""
    after = (LOST_AT, dict.fromkeys(ELEVATOR, 0.5))
    time, flights = fly(AIRCRAFT, multisteps(LOST_AT + 3.0, RATE), RATE, 1, seed=5, after=after)
    fading = OnlineSettings(method="sls_rft", forgetting_time=10.0)
    assert run(AIRCRAFT, fading, time, flights[0], time[-1:])[0].fits["Cm"].r_squared > 0.97


@pytest.mark.slow
@pytest.mark.parametrize("gusts", [0.0, 1.5])
def test_no_change_is_announced_in_unchanged_flight(gusts: float) -> None:
    """A flight of a minute by each method, autopilot in the loop; the bench over hours stands apart."""
    time, flights = fly(AIRCRAFT, multisteps(60.0, RATE, seed=9), RATE, len(METHODS), seed=11, gusts=gusts)
    for method, samples in zip(METHODS, flights, strict=True):
        history = run(AIRCRAFT, OnlineSettings(method=method), time, samples, np.arange(1.0, 60.0, 0.5))
        assert announced(history) == []


def test_flight_that_the_model_does_not_explain_is_outside_it() -> None:
    """Lift that comes and goes by itself, as by separating flow, from 20 s on: CL alone is not to be believed."""
    time = np.arange(0.0, 30.0, 0.01)
    rng = np.random.default_rng(0)
    buffet = np.convolve(rng.normal(size=time.size), np.ones(30) / 30.0, "same") * np.where(time > 20.0, 1.5, 0.0)
    samples = exact_flight(AIRCRAFT, time, extra={"CL": buffet})
    samples[:, :9] += rng.normal(size=(time.size, 9)) * np.repeat([0.05, 0.003, 0.005], 3)
    history = run(AIRCRAFT, OnlineSettings(method="sls_rft"), time, samples, np.arange(10.0, 30.0, 0.5))
    before = [e for e in history if e.time < 20.0]
    assert not [d for e in before for d in e.derivatives.values() if d.status == "outside model"]
    after = [e for e in history if e.time > 23.0]
    outside = [e for e in after if e.derivatives["CL_alpha"].status == "outside model"]
    assert len(outside) > 0.5 * len(after)
    assert not any(e.derivatives["CL_alpha"].valid for e in outside)
    assert not [e for e in after if e.derivatives["Cm_de"].status == "outside model"]


def test_detection_can_be_left_out() -> None:
    after = (10.0, dict.fromkeys(ELEVATOR, 0.3))
    time, flights = fly(AIRCRAFT, multisteps(20.0, RATE), RATE, 1, after=after)
    history = run(AIRCRAFT, OnlineSettings(detect_changes=False), time, flights[0], np.arange(1.0, 20.0, 0.25))
    assert announced(history) == []


def compared(instrumented: bool, off: float) -> Array:
    """Whether an estimate of well-excited flight by least squares contradicts one that is ``off`` by so much."""
    layout = SignalLayout(("alpha", "de"), ("de",), ("alpha",) if instrumented else ())
    plan = normal_equations.normal_equations({"Cm": ("0", "alpha", "de")}, layout)
    rng, said = np.random.default_rng(4), nothing(layout)
    lines = rng.normal(size=(BANDS, 20, layout.width))
    x = lines[..., plan.columns]
    lines[..., plan.outputs[0]] = x.sum(axis=-1) + 0.05 * rng.normal(size=x.shape[:-1])
    if instrumented:  # an instrument that says nothing of its regressor: least squares takes its place
        lines[..., plan.instruments[plan.instruments != plan.columns]] = rng.normal(size=(BANDS, 20, 1))
    said.grams = lines.swapaxes(-1, -2) @ lines
    said.scores, said.traces, said.trace_square = said.grams, np.full(BANDS, 20.0), 20.0 * BANDS
    excited, monitor = no_excited_segments(plan, layout), ChangeMonitor()
    remember(excited, said, 25.0)
    by_least_squares = estimates_of(excited[0], plan, -math.inf, 25.0)
    assert by_least_squares is not None
    published = replace(by_least_squares, time=30.0, equations=plan)
    by = np.full_like(published.solution.theta, off)
    monitor.references.append(
        replace(published, solution=replace(published.solution, theta=published.solution.theta + by))
    )
    compare(plan, monitor, excited, math.inf)
    assert monitor.contradicted_by_excited is not None
    return monitor.contradicted_by_excited


def test_earlier_manoeuvres_contradict_what_is_far_from_them() -> None:
    assert compared(False, 0.5).all()
    assert not compared(False, 0.0).any()


def test_least_squares_contradicts_nothing_that_was_solved_for_by_instruments() -> None:
    """Gusts bias it, and not those."""
    assert not compared(True, 0.5).any()


def test_servos_are_refuted_by_what_they_leave_of_earlier_flight() -> None:
    """The likelihood ratio of fits of noise by q further unknowns has the chi-squared distribution (Wilks, 1938)."""
    rng, many, freedom, unknowns = np.random.default_rng(11), 4000, 80, 3
    noise = rng.normal(size=(many, 2, freedom))
    known = np.full((2, 1), float(freedom))
    with_them, without = (noise**2).sum(axis=-1), (noise[..., unknowns:] ** 2).sum(axis=-1)
    refuted = [
        fits_worse(np.array([known[:, 0], more]), np.array([known[:, 0], less]), 2 * unknowns)
        for more, less in zip(with_them, without, strict=True)
    ]
    assert np.mean(refuted) < SIGNIFICANCE
    few = np.full(2, KNOWN - 1.0)
    left, before = np.array([known[:, 0], [3.0, 1.0]]), np.array([known[:, 0], [1.0, 1.0]])
    assert fits_worse(left, before, 2 * unknowns)
    assert not fits_worse(before, left, 2 * unknowns)
    assert not fits_worse(np.array([few, [3.0, 1.0]]), np.array([few, [1.0, 1.0]]), 2 * unknowns)
