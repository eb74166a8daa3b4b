"""Known effects put into records, and the scorer of spike and recovery. Truth: the simulator's own equations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.signal import butter, sosfiltfilt

from bench.gap.spikes import diagnosed, gap_flight
from bench.spikes import ledger, scores
from bench.spikes.drawing import SETS, Case, draw
from bench.spikes.editing import EFFECTS, edited, misbelieved
from bench.spikes.excusing import INEXCUSABLE, ratio_left
from bench.spikes.judging import judge
from bench.spikes.records import FLIGHTS, belief, part, rate_of, regression
from sysid_node.aircraft.load import load_aircraft
from sysid_node.dynamics.airflow import flow_angles, velocity_of
from sysid_node.dynamics.lever_arm import specific_force_from, velocity_from
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import FlightRecord
from sysid_node.gap.estimation.nuisances import HeldOutFlight, nuisances_of
from sysid_node.gap.flightdata.time_scales import analysis_rate
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.forward_selection import Attribution, attribute
from sysid_node.sim import Simulator

RECORDS = Path(__file__).resolve().parents[4] / "shared" / "flights"
STEP = 0.01
GAP = {"before": 0.5, "tolerances": 0.4, "after": 0.1, "noise_floor": 0.08, "shrink_percent": 95.0}


@pytest.fixture(scope="module")
def flight() -> FlightRecord:
    """A smooth motion of all signals, made by hand."""
    time = np.arange(0.0, 8.0, STEP)
    names = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi", "alpha", "beta", "de", "da", "dr")
    columns = {name: 0.1 * np.sin((0.5 + 0.13 * k) * time + k) for k, name in enumerate(names)}
    return FlightRecord(time, {**columns, "V": 20.0 + 0.5 * np.sin(0.4 * time), "rho": np.full(time.size, 1.2)})


def test_stamps_and_commands_are_shifted_by_the_delay(flight: FlightRecord) -> None:
    inner = slice(20, -20)
    late = edited(flight, "imu_delay", {"delay": 0.1})
    np.testing.assert_allclose(late["q"][inner], flight["q"][inner.start - 10 : inner.stop - 10], atol=1e-9)
    assert late["alpha"] is flight["alpha"]
    earlier = edited(flight, "command_delay", {"delay": 0.1})
    np.testing.assert_allclose(earlier["de"][20:-30], flight["de"][30:-20], atol=1e-9)


def test_a_lag_of_the_edited_commands_gives_the_recorded_positions(flight: FlightRecord) -> None:
    command = edited(flight, "actuator_lag", {"time_constant": 0.1})["de"]
    position = np.empty_like(command)
    position[0], decay = flight["de"][0], np.exp(-STEP / 0.1)
    for k in range(1, command.size):  # exact for a command held at its mean between samples
        position[k] = decay * position[k - 1] + (1.0 - decay) * 0.5 * (command[k - 1] + command[k])
    np.testing.assert_allclose(position, flight["de"], atol=2e-4)


def test_an_imu_and_a_probe_moved_there_and_back_read_the_same(flight: FlightRecord) -> None:
    rates = Vector(*(flight[name] for name in "pqr"))
    turning = Vector(*(np.gradient(w, STEP) for w in rates))
    moved = edited(flight, "imu_lever_arm", {"x": 0.4, "z": -0.2})
    force = specific_force_from(Vector(moved["ax"], moved["ay"], moved["az"]), rates, turning, (0.4, 0.0, -0.2))
    for found, name in zip(force, ("ax", "ay", "az"), strict=True):
        np.testing.assert_allclose(found[100:-100], flight[name][100:-100], atol=1e-4)
    vanes = edited(flight, "vane_lever_arm", {"x": 1.5})
    velocity = velocity_of([vanes[name] for name in ("V", "alpha", "beta")], np)
    back = flow_angles(velocity_from(velocity, tuple(rates), (1.5, 0.0, 0.0)), np)
    for found, name in zip(back, ("V", "alpha", "beta"), strict=True):
        np.testing.assert_allclose(found, flight[name], atol=1e-12)


def test_a_surface_loses_a_part_of_what_is_commanded(flight: FlightRecord) -> None:
    command = edited(flight, "control_effectiveness_loss", {"aileron": 0.4, "onset": 3.0})["da"]
    np.testing.assert_allclose(command[400:] * 0.6, flight["da"][400:])
    np.testing.assert_array_equal(command[:300], flight["da"][:300])


def test_a_belief_is_wrong_by_what_was_put_in() -> None:
    aircraft = load_aircraft(Path(__file__).parents[3] / "config" / "aircraft" / "cdrw.yaml")
    assert misbelieved(aircraft, "mass_error", {"error": 0.25}).mass * 1.25 == pytest.approx(aircraft.mass)
    assert misbelieved(aircraft, "inertia_error", {"Iyy": 0.5}).inertia.Iyy * 1.5 == pytest.approx(aircraft.inertia.Iyy)
    cg = misbelieved(aircraft, "cg_shift", {"x": 0.03})
    arm = 0.03 / aircraft.geometry.cbar  # a point behind the CG is nearer to the neutral point
    slope = aircraft.derivatives["Cm_alpha"].value + arm * aircraft.derivatives["CL_alpha"].value
    assert cg.derivatives["Cm_alpha"].value == pytest.approx(slope)
    assert misbelieved(aircraft, "imu_delay", {"delay": 0.1}) is aircraft


def _row(effect: str, values: dict[str, float], *causes: dict[str, Any], after: float = 0.1) -> dict[str, Any]:
    gap = {**GAP, "after": after, "per_channel": {"ay": {"after": after}}}
    said = {"verdict": "explained", "gap": gap, "air_motion": 0.0, "doubted": []}
    return ledger.row(Case(9, "thor", effect, values), None, {**said, "causes": list(causes)}, "", 1.0, "now")


def _cause(effect: str, probability: float = 0.95, rivals: tuple[str, ...] = (), **sizes: float) -> dict[str, Any]:
    values = {name: [value, 0.01] for name, value in sizes.items()}
    return {"effect": effect, "label": effect, "probability": probability, "indistinguishable_from": list(rivals),
            "parameters": values}  # fmt: skip


def test_an_effect_is_named_first_or_beside_what_the_record_holds() -> None:
    late, bias = _cause("command_delay", delay=0.06), _cause("imu_bias", p=0.03)
    judged = judge(_row("imu_bias", {"p": 0.032}, late, bias), ("command_delay",), {"after": 0.1})
    assert (judged.named, judged.sized, judged.closed, judged.blamed) == (True, True, True, False)
    judged = judge(_row("imu_bias", {"p": 0.06}, late, bias, after=0.12), (), {"after": 0.1})
    assert (judged.named, judged.closed, judged.blamed) == (False, False, True)
    judged = judge(_row("imu_bias", {"p": 0.06}, bias, after=0.12), (), {"after": 0.1})
    assert (judged.named, judged.sized) == (True, False)
    lag = _cause("actuator_lag", elevator=0.11, rudder=0.4)  # stated for each control
    assert judge(_row("actuator_lag", {"time_constant": 0.1}, lag), (), None).sized is False
    lag = _cause("actuator_lag", elevator=0.11)
    assert judge(_row("actuator_lag", {"time_constant": 0.1}, lag), (), None).sized
    lag = _cause("actuator_lag", elevator=0.0707, rudder=0.0707, damping=1.06)  # 0.05 and 0.1 s, one after the other
    assert judge(_row("actuator_lag", {"time_constant": 0.05}, lag), (), None, {"actuator_lag": 0.1}).sized
    assert not judge(_row("actuator_lag", {"time_constant": 0.05}, lag), (), None, {"actuator_lag": 0.0}).sized
    rivals = _cause("vane_scale", 0.5, ("imu_bias",), alpha=0.2)
    assert judge(_row("imu_bias", {"p": 0.06}, rivals), (), None).named


def test_the_gap_is_back_on_the_channels_that_count_in_the_record_as_it_is_too() -> None:
    """A held elevator's command moves, so that pitch counts in a lateral record where it did not before."""
    row = _row("stuck_surface", {"elevator": 0.05}, _cause("stuck_surface", elevator=0.05))
    bare = {"after": 0.1, "after_by_channel": {"ay": 0.1, "r": 0.2}}
    for channels, back in (
        ({"ay": 0.1, "r": 0.2, "q": 1.3}, True),
        ({"ay": 0.13, "r": 0.2, "q": 1.3}, True),  # both together within a tenth
        ({"ay": 0.1, "r": 0.24}, False),
        ({"ay": 0.1}, True),
        ({"ay": 0.12}, False),
    ):
        row["gap"]["after_by_channel"] = channels
        assert judge(row, (), bare).closed is back


def test_what_is_put_in_adds_to_what_the_record_holds_of_the_same_effect() -> None:
    late = _cause("command_delay", delay=0.16)
    row = _row("command_delay", {"delay": 0.1}, late)
    assert judge(row, ("command_delay",), None, {"command_delay": 0.06}).sized
    assert not judge(row, ("command_delay",), None).sized


def test_nothing_may_be_blamed_in_a_record_as_it_is() -> None:
    assert judge(_row("", {}, _cause("imu_scale", 0.9, q=0.2)), (), None).blamed
    assert not judge(_row("", {}, _cause("imu_scale", 0.7, q=0.2)), (), None).blamed
    assert not judge(_row("", {}, _cause("command_delay", 0.9)), ("command_delay",), None).blamed


def test_the_page_counts_cases_and_lists_what_was_missed() -> None:
    bare = {**_row("", {}), "seed": 0}
    rows = [
        bare,
        _row("imu_bias", {"p": 0.03}, _cause("imu_bias", p=0.03)),
        {**_row("mass_error", {"error": 0.25}), "left": 1.7},
    ]
    text = scores.page(rows)
    assert "2 cases with an effect put in, 1 records as they are" in text
    assert "| thor | mass_error (error 0.25) | 1.70 | explained: - |" in text


@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
def test_cases_are_drawn_alike_again_and_sets_apart() -> None:
    cases = [draw(RECORDS, "development", seed) for seed in range(30)]
    assert cases == [draw(RECORDS, "development", seed) for seed in range(30)]
    assert [case.flight for case in cases[:8]] == list(FLIGHTS)
    assert not any(case.effect for case in cases[:8])
    assert {case.effect for case in cases[8:]} <= set(EFFECTS)
    assert not any(case.effect in FLIGHTS[case.flight].cancelled for case in cases)
    assert set(SETS) == {"development", "final"}
    assert [draw(RECORDS, "final", seed) for seed in range(8, 30)] != cases[8:]


@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
def test_the_belief_has_the_derivatives_that_the_field_finds() -> None:
    """SIDPAC: CZ_alpha -6.35, Cm_alpha -1.476, Cm_q -36.4, Cm_de -1.87 (docs/results/real_flights.md)."""
    as_recorded = replace(FLIGHTS["twin_otter"], air_late=0.0)  # as SIDPAC takes it
    found = {name: d.value for name, d in belief(RECORDS, as_recorded).derivatives.items()}
    assert found["CL_alpha"] == pytest.approx(6.35, rel=0.03)
    assert found["Cm_alpha"] == pytest.approx(-1.476, rel=0.03)
    assert found["Cm_q"] == pytest.approx(-36.4, rel=0.05)
    assert found["Cm_de"] == pytest.approx(-1.87, rel=0.05)


@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
@pytest.mark.parametrize("name", ["twin_otter", "hfb320"])
def test_the_flow_angle_is_as_late_as_is_said_against_the_integrated_rates_and_forces(name: str) -> None:
    """Truth: kinematics. The integral of q + (az cos alpha - ax sin alpha + g cos(theta - alpha)) / V is alpha."""
    record = part(RECORDS, FLIGHTS[name], FLIGHTS[name].fitted[0])
    time, rate = record.time, rate_of(record)
    alpha, theta, V = record["alpha"], record["theta"], record["V"]
    force = record["az"] * np.cos(alpha) - record["ax"] * np.sin(alpha) + 9.80665 * np.cos(theta - alpha)
    angle = cumulative_trapezoid(record["q"] + force / V, time, initial=0)
    high = butter(2, 0.2, "highpass", fs=rate, output="sos")
    seen, inner = sosfiltfilt(high, alpha), slice(round(rate), -round(rate))
    delays = np.linspace(-0.1, 0.4, 101)
    left = [np.std((seen - sosfiltfilt(high, np.interp(time - d, time, angle)))[inner]) for d in delays]
    assert delays[np.argmin(left)] == pytest.approx(FLIGHTS[name].air_late, abs=0.03)


@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
@pytest.mark.parametrize(("part_of", "surface", "coefficient"), [(0, "da", 3), (1, "dr", 5)])
def test_each_surface_of_the_lateral_record_follows_as_late_as_is_said(
    part_of: int, surface: str, coefficient: int
) -> None:
    """Truth: of all times by which the readings of a surface are shifted, the one that leaves least of its moment.

    Each surface is shifted in the manoeuvre that is flown with it. The range holds two standard errors.
    """
    flight = FLIGHTS["attas"]
    aircraft, record = belief(RECORDS, flight), part(RECORDS, flight, flight.fitted[part_of])
    found, columns = regression(aircraft, flight, record)
    moment, delays = found[:, coefficient], np.linspace(-0.06, 0.06, 49)
    matrix = np.column_stack([np.ones(moment.size), *(columns[n] for n in ("beta", "p", "r", "da", "dr"))])
    place, time = 4 if surface == "da" else 5, np.arange(moment.size) / rate_of(record)

    def left(delay: float) -> float:
        shifted = matrix.copy()
        shifted[:, place] = np.interp(time - delay, time, columns[surface])
        error = (moment - shifted @ np.linalg.lstsq(shifted, moment)[0])[5:-5]
        return float(error @ error)

    control = {"da": "aileron", "dr": "rudder"}[surface]
    late, room = flight.own[f"command_delay.{control}"], {"da": 0.004, "dr": 0.012}[surface]
    assert delays[np.argmin([left(d) for d in delays])] == pytest.approx(late, abs=room)


@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
def test_the_belief_states_the_noise_that_the_record_shows() -> None:
    """Of the HFB-320's pitch rate the upper third of the spectrum (3.5 to 5 Hz) has the power of 0.0003 to 0.0005."""
    assert 3e-4 < belief(RECORDS, FLIGHTS["hfb320"]).noise["gyro"] < 5e-4


@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
def test_tolerances_excuse_what_lies_within_three_of_them_and_no_more() -> None:
    """The stability of the Twin Otter has a tolerance of a tenth, 0.15; a mass shifts each coefficient alike."""
    excused = Case(0, "twin_otter", "derivative_error", {"Cm_alpha": 0.3})
    assert ratio_left(RECORDS, excused) == pytest.approx(1.0, abs=0.01)
    assert ratio_left(RECORDS, Case(0, "twin_otter", "derivative_error", {"Cm_alpha": 0.93})) > INEXCUSABLE
    assert ratio_left(RECORDS, Case(0, "hfb320", "mass_error", {"error": 0.25})) < INEXCUSABLE


@pytest.mark.slow
@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
def test_a_file_of_another_mass_is_left_for_derivatives_that_fly_the_record() -> None:
    """By frequency both predict alike; in short flights the file is off by several times the motion.

    The file is that of the air data as they were recorded: with that of air data on time, the two do not predict alike.
    """
    as_recorded = replace(FLIGHTS["hfb320"], air_late=0.0)
    gap = diagnosed(RECORDS, Case(0, "hfb320", "mass_error", {"error": 0.25}), as_recorded)["gap"]
    assert gap["before"] > 5.0
    assert gap["after"] < 0.2 * gap["before"]


def attributed(case: Case) -> Attribution:
    """The causes of a case as a diagnosis finds them, before the gap is measured."""
    flight = FLIGHTS[case.flight]
    aircraft = misbelieved(belief(RECORDS, flight), case.effect, case.values)
    fitted, held = (
        [gap_flight(aircraft, edited(part(RECORDS, flight, span), case.effect, case.values), span[0]) for span in spans]
        for spans in (flight.fitted, flight.held)
    )
    simulator = Simulator(aircraft, analysis_rate(aircraft, lateral=any(each.lateral for each in fitted)))
    models, others = ([residual_model_of(simulator, each) for each in group] for group in (fitted, held))
    every = (*models, *others)
    nuisances = nuisances_of(aircraft, models[0], every, fitted_with=models[1:])
    held_out = [HeldOutFlight(model, nuisances_of(aircraft, model, every)) for model in others]
    return attribute(models, nuisances, lambda share, text: None, None, held_out)


@pytest.mark.slow
@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
def test_late_commands_beside_a_lag_are_no_servo_of_second_order() -> None:
    """Both have as many parameters, and the lag and the delay predict the record better."""
    fit = attributed(Case(0, "cessna_de", "command_delay", {"delay": 0.09})).corrected
    names = [fit.simulator.names[i] for i in fit.indices]
    sizes = dict(zip(names, fit.values, strict=True))
    assert set(sizes) == {"command_delay.delay", "actuator_lag.time_constant"}
    assert sizes["command_delay.delay"] == pytest.approx(0.09, rel=0.2)


@pytest.mark.slow
@pytest.mark.skipif(not RECORDS.is_dir(), reason="the real flight records are not beside the project")
def test_what_was_dropped_beside_one_cause_is_looked_for_beside_what_took_its_place() -> None:
    """Beside slow servos of all surfaces half an aileron is not needed; slow ailerons alone leave it to be found."""
    found = attributed(Case(0, "cessna_da", "control_effectiveness_loss", {"aileron": 0.46}))
    assert set(found.labels) == {"actuator_lag of aileron", "control_effectiveness_loss of aileron"}
