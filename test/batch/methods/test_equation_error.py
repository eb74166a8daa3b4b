"""Equation error in the time domain against SIDPAC, and what both equation-error methods have in common."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, TRUTH, clean, flight, scores
from reference_flights import TWIN_OTTER_EQUATION_ERROR, twin_otter

from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.methods.frequency_equation_error import frequency_equation_error
from sysid_node.batch.regression.linear_regression import regress
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord


@pytest.fixture(scope="module")
def otter(flights):
    case = twin_otter(flights)
    found = measured_coefficients(case.aircraft, case.record)
    X = np.column_stack([found.regressors[name] for name in ("alpha", "q", "de", "0")])
    return found, X


@pytest.mark.parametrize("coefficient", ["CZ", "Cm"])
def test_time_domain_figures_are_sidpacs(otter, coefficient):
    found, X = otter
    fit = regress(["alpha", "q", "de", "0"], [found.coefficients[coefficient]], [X])
    for name, (value, error) in TWIN_OTTER_EQUATION_ERROR[coefficient].items():
        # SIDPAC smooths as it differentiates the rate, which weakens the moment: within 5 %
        allowed = 1.0 * error if coefficient == "CZ" else 0.055 * abs(value)
        assert abs(fit.estimates[name].value - value) < allowed, name
        assert fit.estimates[name].standard_error == pytest.approx(error, rel=0.3), name


@pytest.mark.parametrize("method", [equation_error, frequency_equation_error])
def test_clean_flights_give_the_truth(method):
    fit = method(KESTREL, [clean()])
    for name, value in TRUTH.items():
        coefficient = name.partition("_")[0]
        largest = max(abs(v) for n, v in TRUTH.items() if n.startswith(coefficient + "_"))
        assert fit.values[name] == pytest.approx(value, abs=0.01 * largest), name


@pytest.mark.parametrize("method", [equation_error, frequency_equation_error])
def test_noisy_flights_are_within_their_intervals(method):
    fit = method(KESTREL, [flight(1), flight(2, turn=-1)])
    assert np.mean(np.abs(scores(fit.estimates)) < 2.0) > 0.8
    assert np.abs(scores(fit.estimates)).max() < 4.5
    assert {"CL", "CD", "CY", "Cl", "Cm", "Cn"} == set(fit.responses[0].names)


def test_gaps_are_left_out_and_counted():
    record = flight(3)
    alpha = record["alpha"].copy()
    alpha[300:330] = np.nan
    fit = equation_error(KESTREL, [dataclasses.replace(record, columns={**record.columns, "alpha": alpha})])
    assert any("30 of 1200 samples lack a value" in remark for remark in fit.remarks)
    assert np.isfinite(list(fit.values.values())).all()


def test_a_signal_never_measured_is_named():
    record = clean()
    columns = {name: values for name, values in record.columns.items() if name != "beta"}
    with pytest.raises(InputError, match="beta not measured, which the model of aircraft kestrel needs"):
        equation_error(KESTREL, [FlightRecord(record.time, columns, "blind")])


def test_without_thrust_there_is_no_drag():
    record = clean()
    columns = {name: values for name, values in record.columns.items() if name != "thrust"}
    fit = equation_error(KESTREL, [FlightRecord(record.time, columns, "gliding")])
    assert not any(name.startswith("CD") for name in fit.estimates)
    assert "thrust was not measured: drag cannot be told from it, and CD is left out" in fit.remarks
    assert "CL_alpha" in fit.estimates


def test_an_unknown_inertia_costs_its_moment():
    aircraft = dataclasses.replace(KESTREL, inertia=dataclasses.replace(KESTREL.inertia, Iyy=np.nan))
    fit = equation_error(aircraft, [clean()])
    assert not any(name.startswith("Cm") for name in fit.estimates)
    assert "Cm left out: its moment of inertia is not in the aircraft file" in fit.remarks


def test_a_still_control_is_not_excited():
    record = clean()
    still = {**record.columns, "dr": np.zeros(len(record))}
    fit = equation_error(KESTREL, [dataclasses.replace(record, columns=still)])
    assert fit.estimates["Cn_dr"].status == "not excited"
    assert not fit.estimates["Cn_dr"].valid
    assert fit.estimates["Cm_de"].valid


@pytest.mark.parametrize("method", [equation_error, frequency_equation_error])
def test_noise_on_a_regressor_that_hardly_moves_is_no_excitation(method):
    """Level flight: all that the vane and the gyroscopes show is their own noise, which explains nothing."""
    rng, samples = np.random.default_rng(6), 1000
    columns = {name: np.full(samples, float(values[0])) for name, values in clean().columns.items()}
    for name, kind in (("alpha", "alpha"), ("beta", "beta"), ("p", "gyro"), ("q", "gyro"), ("r", "gyro")):
        columns[name] = columns[name] + KESTREL.noise[kind] * rng.normal(size=samples)
    for name in ("de", "da", "dr", "ax", "ay", "az"):
        columns[name] = columns[name] + 0.01 * rng.normal(size=samples)
    fit = method(KESTREL, [FlightRecord(np.arange(samples) / 50.0, columns, "level")])
    for name in ("CL_alpha", "Cm_alpha", "Cm_q", "CY_beta", "Cl_p", "Cn_r"):
        assert fit.estimates[name].status == "not excited: its regressor is within the sensor's noise", name
        assert not fit.estimates[name].valid


@pytest.mark.parametrize("method", [equation_error, frequency_equation_error])
def test_too_short_a_flight_for_its_band_is_refused(method):
    with pytest.raises(InputError, match=r"independent values.*give a longer flight"):
        method(KESTREL, [clean(0.4)])


@pytest.mark.parametrize("method", [equation_error, frequency_equation_error])
def test_a_flight_in_which_nothing_moves_has_nothing_valid(method):
    record = clean()
    still = {name: np.full(len(record), values[0]) for name, values in record.columns.items()}
    fit = method(KESTREL, [dataclasses.replace(record, columns=still)])
    assert not any(estimate.valid for estimate in fit.estimates.values())
    assert all(np.isfinite(estimate.value) for estimate in fit.estimates.values())
