"""Whole flights through every method, with held-out flights, whatever was measured."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, TRUTH, clean, flight, scores

from sysid_node.batch.identify import METHODS, identify
from sysid_node.batch.settings import BatchSettings
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord

#: Fast: fewer samples, and pieces of one length.
QUICK = BatchSettings(rate=50.0, segment=6.0)


def without(record, *names):
    return FlightRecord(record.time, {n: v for n, v in record.columns.items() if n not in names}, record.name)


@pytest.fixture(scope="module", params=("equation_error", "frequency_equation_error", "output_error"))
def found(request):
    return identify(request.param, KESTREL, [flight(1)], QUICK, [flight(2, turn=-1)])


@pytest.mark.slow
def test_every_method_finds_the_truth(found):
    assert found.fit.search.converged
    assert set(found.fit.estimates) == set(TRUTH)
    assert np.mean(np.abs(scores(found.fit.estimates)) < 2.2) > 0.8
    assert np.abs(scores(found.fit.estimates)).max() < 5.0


@pytest.mark.slow
def test_every_method_answers_a_held_out_flight(found):
    ((name, outputs),) = found.holdout.items()
    assert name == "kestrel -1 #2"
    assert {"CL", "CD", "CY", "Cl", "Cm", "Cn"} <= set(outputs)
    if found.fit.method == "output_error":
        assert {"V", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az"} <= set(outputs)
    assert all(figures["r_squared"] > 0.9 for output, figures in outputs.items() if output not in ("CD", "ax", "V"))


@pytest.mark.slow
def test_filter_error_on_two_states_that_the_others_are_measured_for():
    settings = dataclasses.replace(QUICK, states=("alpha", "q"))
    found = identify("filter_error", KESTREL, [flight(1)], settings, [flight(2, turn=-1)])
    assert found.fit.search.converged
    assert np.abs(scores(found.fit.estimates)).max() < 5.0
    assert {"CL", "Cm", "alpha", "q", "az"} == set(found.holdout["kestrel -1 #2"])
    assert found.holdout["kestrel -1 #2"]["q"]["r_squared"] > 0.95


def test_output_error_is_the_sharpest_on_still_air():
    errors = {
        method: identify(method, KESTREL, [flight(1)], QUICK).fit.estimates["Cm_q"].standard_error
        for method in ("equation_error", "output_error")
    }
    assert errors["output_error"] < 0.5 * errors["equation_error"]


@pytest.mark.slow
def test_a_flight_without_a_sideslip_vane_can_still_be_integrated():
    found = identify("output_error", KESTREL, [without(flight(1), "beta")], QUICK)
    assert any("started from the aircraft file's values" in remark for remark in found.fit.remarks)
    assert found.fit.search.converged
    assert abs(found.fit.values["Cn_beta"] - TRUTH["Cn_beta"]) < 4 * found.fit.estimates["Cn_beta"].standard_error


def test_longitudinal_motion_alone():
    settings = dataclasses.replace(QUICK, states=("alpha", "q"))
    fit = identify("output_error", KESTREL, [flight(1)], settings).fit
    assert {name.partition("_")[0] for name in fit.estimates} == {"CL", "Cm"}
    assert np.abs(scores(fit.estimates)).max() < 6.0


@pytest.mark.slow
def test_stepwise_and_sensor_correction_are_told():
    settings = dataclasses.replace(QUICK, stepwise=True, correct_sensors=True)
    found = identify("equation_error", KESTREL, [flight(1)], settings)
    assert any(remark.startswith("stepwise regression left out") for remark in found.fit.remarks)
    assert any("sensor" in remark for remark in found.fit.remarks)
    assert set(found.selections) == {"CL", "CD", "CY", "Cl", "Cm", "Cn"}


def test_flights_of_one_name_are_kept_apart():
    found = identify("equation_error", KESTREL, [flight(1)], QUICK, [flight(2), flight(2)])
    assert len(found.holdout) == 2


def test_an_unknown_method_and_no_flight_are_refused():
    with pytest.raises(InputError, match="method 'kalman': expected one of equation_error"):
        identify("kalman", KESTREL, [clean()], QUICK)
    with pytest.raises(InputError, match="no flight to identify from"):
        identify("equation_error", KESTREL, [], QUICK)


@pytest.mark.parametrize("method", ["output_error", "filter_error"])
def test_a_flight_of_three_samples_is_refused(method):
    whole = flight(1)
    short = dataclasses.replace(whole, time=whole.time[:3], columns={k: v[:3] for k, v in whole.columns.items()})
    with pytest.raises(InputError, match="too short"):
        identify(method, KESTREL, [short], QUICK)


@pytest.mark.parametrize("method", ["output_error", "filter_error"])
@pytest.mark.parametrize("reading", [np.nan, np.inf])
def test_a_flight_without_airspeed_is_refused(method, reading):
    whole = clean()
    blind = dataclasses.replace(whole, columns={**whole.columns, "V": np.full(len(whole), reading)})
    with pytest.raises(InputError, match="airspeed was never measured"):
        identify(method, KESTREL, [blind], QUICK)


def test_filter_error_refuses_a_command_that_is_missing_most_of_the_time():
    whole = clean()
    rare = np.where(np.arange(len(whole)) % 10 == 0, whole["de"], np.nan)
    with pytest.raises(InputError, match="model rigid_body needs de, which it did not measure"):
        identify("filter_error", KESTREL, [dataclasses.replace(whole, columns={**whole.columns, "de": rare})], QUICK)


@pytest.mark.parametrize(
    "method", ["equation_error", "frequency_equation_error", "output_error", "extended_kalman_filter"]
)
def test_an_interrupted_recording_gives_what_a_whole_one_gives(method):
    whole = flight(1)
    kept = ~((whole.time > 5.0) & (whole.time < 6.2))  # between the aileron's manoeuvre and the rudder's
    columns = {name: values[kept] for name, values in whole.columns.items()}
    interrupted = dataclasses.replace(whole, time=whole.time[kept], columns=columns)
    fit = identify(method, KESTREL, [interrupted], QUICK).fit
    assert "the recording is interrupted once, for 1.2 of 12 s in all" in " ".join(fit.remarks)
    valid = {name: e for name, e in fit.estimates.items() if e.valid}
    assert len(valid) > 20
    assert np.abs(scores(valid)).max() < 5.0
    assert np.mean(np.abs(scores(valid)) < 2.2) > 0.8


@pytest.mark.parametrize("method", METHODS)
def test_a_flight_that_ends_before_the_aircraft_has_answered_is_too_short(method):
    with pytest.raises(InputError, match="give a longer flight"):
        identify(method, KESTREL, [clean(0.25)], QUICK)


def test_several_short_flights_make_a_long_one():
    fit = identify("recursive_least_squares", KESTREL, [clean(0.25)] * 6, QUICK).fit
    assert set(fit.estimates) == set(TRUTH)
