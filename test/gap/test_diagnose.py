"""What is put in is found again, by name and size, through derivatives that are wrong; truth: the effects flown."""

import json
import re
from dataclasses import replace

import pytest
from gap_flights import fly

from sysid_node.errors import InputError
from sysid_node.gap.diagnose import diagnose
from sysid_node.gap.document import document
from sysid_node.report.pages.gap_page import write_gap_report
from sysid_node.report.sections.gap.candidates import candidates

WRONG = {"Cm_alpha": 0.015, "Cm_de": 0.04, "CL_alpha": -0.2, "Cl_p": 0.03, "Cn_beta": 0.006, "Cl_da": 0.02}


@pytest.fixture(scope="module")
def lagging(aircraft):
    effects = {"actuator_lag": {"time_constant": 0.08}, "derivative_error": WRONG}
    return diagnose(aircraft, [fly(aircraft, effects, seed=5)], [fly(aircraft, effects, seed=6)])


def test_a_lag_is_named_with_its_size(lagging) -> None:
    assert lagging.verdict == "explained"
    (cause,) = document(lagging)["causes"]
    assert cause["effect"] == "actuator_lag" and cause["station"] == "actuator"
    assert cause["parameters"]["time_constant"][0] == pytest.approx(0.08, rel=0.15)


def test_the_gap_closes_on_flight_held_out(lagging) -> None:
    gap = lagging.gap
    assert gap.after < 0.5 * gap.tolerances < 0.5 * gap.before
    assert gap.after < 1.5 * gap.noise_floor
    assert gap.ci95[0] <= gap.shrink_percent <= gap.ci95[1]


def test_the_document_is_json_and_its_shares_add_up(lagging) -> None:
    found = json.loads(json.dumps(document(lagging), allow_nan=False))
    assert sum(w["share"] for w in found["where"]) == pytest.approx(1.0)
    assert {"verdict", "gap", "where", "causes", "unexplained", "next_flight"} <= found.keys()


def test_its_report_is_drawn_without_a_complaint(lagging, tmp_path, browse) -> None:
    write_gap_report(tmp_path / "report.html", lagging)
    page = browse(tmp_path / "report.html")
    assert page.complaints == []
    assert page.drawn == page.plots > len(lagging.simulation_gap.per_channel)


def test_what_is_doubted_is_told(lagging) -> None:
    attribution = replace(lagging.attribution, causes=(), doubted=lagging.attribution.causes)
    found = replace(lagging, attribution=attribution)
    assert [c["effect"] for c in document(found)["doubted"]] == ["actuator_lag"]
    assert document(found)["doubted"][0]["parameters"] == document(lagging)["causes"][0]["parameters"]
    assert re.match(
        r"actuator lag \(probability over 0\.99; time constant 0\.0[78]\S* ± \S+ s\)", candidates(found)["doubted"]
    )
    assert not candidates(lagging)["doubted"]


def test_the_best_of_the_list_is_not_there_for_that(lagging) -> None:
    (cause,) = lagging.attribution.causes
    best, *others = document(lagging)["candidates"]
    assert (best["effect"], best["probability"]) == ("actuator_lag", cause.probability)
    assert best["share"] + sum(c["share"] for c in others) == pytest.approx(1.0)
    found = replace(lagging, attribution=replace(lagging.attribution, causes=(), doubted=()))
    best, *others = document(found)["candidates"]
    assert best["share"] > 0.9 and {c["probability"] for c in (best, *others)} == {None}


def test_tolerances_are_no_gap(aircraft) -> None:
    flight = fly(aircraft, {"derivative_error": WRONG}, seed=7)
    assert diagnose(aircraft, [flight], []).verdict == "no_gap"


def test_a_held_out_flight_must_be_another(aircraft, plain) -> None:
    with pytest.raises(InputError, match="is the same flight"):
        diagnose(aircraft, [plain], [plain])


def test_a_flight_in_which_nothing_moves_is_said(aircraft) -> None:
    with pytest.raises(InputError, match="moves"):
        diagnose(aircraft, [fly(aircraft, {}, seed=8, manoeuvre=[])], [])
