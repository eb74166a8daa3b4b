"""What is put in is found again, by name and size, through derivatives that are wrong; truth: the effects flown."""

from dataclasses import replace

import pytest
from gap_flights import fly, interrupted

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import parse_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.errors import InputError, InputWarning
from sysid_node.gap.correction import corrected_aircraft
from sysid_node.gap.diagnose import diagnose
from sysid_node.gap.document import document
from sysid_node.gap.validation.simulation_error import side_by_side
from sysid_node.report.pages.gap_page import write_gap_report
from sysid_node.report.sections.gap.flight import most_off
from sysid_node.report.sections.gap.paragraph import paragraph


def test_a_lag_is_named_with_its_size(lagging) -> None:
    assert lagging.verdict == "explained"
    (cause,) = document(lagging)["causes"]
    assert cause["effect"] == "actuator_lag" and cause["station"] == "actuator"
    assert cause["parameters"]["elevator"][0] == pytest.approx(0.08, rel=0.15)


def test_the_gap_closes_on_flight_held_out(lagging) -> None:
    gap = lagging.gap
    assert gap.after < 0.5 * gap.tolerances < 0.5 * gap.before
    assert gap.after < 1.5 * gap.noise_floor
    assert gap.ci95[0] <= gap.shrink_percent <= gap.ci95[1]


@pytest.mark.slow
def test_its_report_is_drawn_and_fits_every_width(lagging, tmp_path, browse, fit_everywhere) -> None:
    report = tmp_path / "gap" / "report.html"
    report.parent.mkdir()
    write_gap_report(report, lagging, warnings=["flight: 3 of 4 clocks agree"])
    assert "<li>flight: 3 of 4 clocks agree</li>" in report.read_text()
    page = browse(report)
    assert page.complaints == []
    assert page.drawn == page.plots > len(lagging.simulation_gap.per_channel)
    fit_everywhere(report)


@pytest.mark.slow
def test_servos_slower_than_the_file_says_are_named_and_the_corrected_file_leaves_no_gap(aircraft) -> None:
    """A single flight with each manoeuvre once is checked on its parts, each of which then holds what no other does.

    A lag that moved every reading must not be lost for that.
    """
    stated = replace(aircraft, effects={"actuator_lag": dict.fromkeys(aircraft.controls, UncertainValue(0.03, 0.006))})
    flown = {"actuator_lag": {"elevator": 0.12, "aileron": 0.12, "rudder": 0.12}}
    steps = ["3211:elevator:start=2", "3211:aileron:start=11", "3211:rudder:start=20"]
    flight, other = (fly(stated, flown, seed=seed, manoeuvre=steps, duration=29.0) for seed in (21, 22))
    first = diagnose(stated, [flight], [])
    (cause,) = document(first)["causes"]
    assert (first.verdict, cause["label"]) == ("explained", "actuator_lag")
    assert first.size.after < 0.7 * first.size.before
    assert cause["parameters"]["elevator"][0] == pytest.approx(0.12, rel=0.1)
    assert cause["believed"] == pytest.approx(dict.fromkeys(aircraft.controls, 0.03))
    assert "the aircraft file says all controls 0.0300 s" in paragraph(first)
    corrected = parse_aircraft(dump_aircraft(corrected_aircraft(first)))
    assert diagnose(corrected, [other], []).verdict == "no_gap"


@pytest.mark.slow
def test_a_failure_outside_of_the_longest_part_of_an_interrupted_recording_is_found(aircraft) -> None:
    flown = {"control_effectiveness_loss": {"elevator": 0.5, "onset": 17.0}}
    with pytest.warns(InputWarning, match="its 2 parts"):
        parts = interrupted(aircraft, fly(aircraft, flown, seed=16), 14.0, 15.0)
    assert diagnose(aircraft, parts[:1], []).verdict == "no_gap"
    found = diagnose(aircraft, parts, [])
    (cause,) = document(found)["causes"]
    assert (found.verdict, cause["label"]) == ("explained", "control_effectiveness_loss of elevator")
    assert cause["parameters"]["onset"][0] == pytest.approx(17.0, abs=0.5)
    assert cause["parameters"]["elevator"][0] == pytest.approx(0.5, abs=0.05)
    begin, end = found.where[0]["window_s"]
    assert 15.0 < begin < end < 26.0  # the second part holds most of the gap
    evidence = zip(found.models, found.check.corrected.flights, strict=True)
    assert most_off([side_by_side(model, flight.points) for model, flight in evidence]).time[0] >= 15.0


@pytest.mark.slow
def test_tolerances_are_no_gap(aircraft, wrong_derivatives) -> None:
    flight = fly(aircraft, {"derivative_error": wrong_derivatives}, seed=7)
    assert diagnose(aircraft, [flight], []).verdict == "no_gap"


def test_a_held_out_flight_must_be_another(aircraft, plain) -> None:
    with pytest.raises(InputError, match="is the same flight"):
        diagnose(aircraft, [plain], [plain])


def test_a_flight_in_which_nothing_moves_is_said(aircraft) -> None:
    with pytest.raises(InputError, match="moves"):
        diagnose(aircraft, [fly(aircraft, {}, seed=8, manoeuvre=[])], [])
