"""What a whole small fleet tells: the worn tail and nothing else, priors that combine, and content for JSON."""

import json
from dataclasses import replace

import numpy as np
import pytest
from fleet_flights import fleet

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft, parse_aircraft
from sysid_node.fleet.results import FleetResults, Refusal
from sysid_node.fleet.statistics.prior import TailPrior, tail_aircraft
from sysid_node.fleet.statistics.summarise import summarise


@pytest.fixture(scope="module")
def found():
    refusals = (Refusal("x", "cdrw", "t1", None, "no air data"), Refusal("y", "cdrw", "t1", None, "no air data"))
    file = load_aircraft("cdrw")
    file = replace(file, derivatives={**file.derivatives, "Cl_da": replace(file.derivatives["Cl_da"], value=0.3)})
    flights = tuple(fleet(worn="t3", wear=-0.04))
    return summarise(FleetResults(flights, refusals, ()), {"cdrw": file})


def test_the_worn_tail_drifts_and_no_other(found):
    drifting = [key for key, drift in found.drifts.items() if drift.significant]
    assert drifting == [("cdrw", "t3", "Cl_da")]
    assert found.drifts["cdrw", "t3", "Cl_da"].change == pytest.approx(-0.04, abs=0.015)


def test_its_prior_is_its_present_state(found):
    prior = found.priors["cdrw", "t3"]["Cl_da"]
    steady = found.populations["cdrw", "Cl_da"].fit.by_tail.level[3]
    assert prior.value == pytest.approx(steady - 0.04, abs=0.015)
    assert prior.error > found.priors["cdrw", "t2"]["Cl_da"].error  # the step is uncertain


def test_the_type_differs_from_the_file_where_the_file_is_wrong(found):
    difference = found.differences["cdrw", "Cl_da"]
    assert difference.significant
    assert difference.difference == pytest.approx(-0.1, abs=0.02)


def test_an_estimate_combines_with_the_prior_by_what_they_do_not_share():
    prior = TailPrior(value=1.0, error=0.3, systematic=0.5, shrinkage=0.1, flights=9)
    value, error, weight = prior.combined(2.0, 0.4)
    assert weight == pytest.approx(0.16 / 0.25)
    assert value == pytest.approx(1.0 + 0.09 / 0.25)
    assert error == pytest.approx(np.hypot(0.3 * 0.4 / 0.5, 0.5))  # the systematic error is not averaged away


def test_the_tails_aircraft_file_can_be_read_back(found):
    file = tail_aircraft(load_aircraft("cdrw"), "t3", found.priors["cdrw", "t3"])
    prior = found.priors["cdrw", "t3"]["Cl_da"]
    read = parse_aircraft(dump_aircraft(file))
    assert read.derivatives["Cl_da"].value == prior.value
    assert read.derivatives["Cl_da"].tolerance == prior.tolerance
    assert read.derivatives["Cm_alpha"] == load_aircraft("cdrw").derivatives["Cm_alpha"]


def test_json_has_no_nan_and_says_how_often_flights_were_refused(found):
    content = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert content["refusals"] == {"no air data": 2}
    assert {p["name"] for p in content["populations"]} == {"Cl_da", "Cl_p"}
    assert content["populations"][0]["by_tail"][0]["shrinkage"] < 0.5


def test_one_flight_is_no_fleet_and_still_has_a_summary():
    found = summarise(FleetResults(tuple(fleet(tails=1, flights=1)), (), ()))
    assert not found.drifts and not found.deviations
    json.dumps(found.to_json(), allow_nan=False)
