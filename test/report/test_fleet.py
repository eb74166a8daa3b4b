"""The fleet's page, tables and aircraft files, from a small fleet whose worn tail and shared cause are known."""

import csv
import re
from dataclasses import replace

import pytest
from fleet_flights import START, fleet

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.fleet.results import FleetResults, MaintenanceNote, Refusal
from sysid_node.fleet.statistics.series import DAY
from sysid_node.fleet.statistics.summarise import summarise
from sysid_node.report.fleet import file_name, write
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.wording.fleet import date_words, findings, tail_sentence

GAP = {
    "verdict": "explained",
    "causes": [
        {
            "effect": "motor_lag",
            "label": "motor_lag",
            "parameters": {"time_constant": [0.2, 0.02]},
            "probability": 0.9,
            "indistinguishable_from": [],
        }
    ],
    "doubted": [],
    "candidates": [],
}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A written fleet: its folder, results and summary."""
    flights = tuple(replace(f, gap=GAP) for f in fleet(worn="t3", wear=-0.04, tails=6))
    refusals = (Refusal("a.ulg", "cdrw", "t1", None, "a.ulg: no <air> data; log it"),)
    results = FleetResults(flights, refusals, (MaintenanceNote("t3", START.replace(month=3, day=15), "new servo"),))
    files = {"cdrw": load_aircraft("cdrw")}
    folder = tmp_path_factory.mktemp("fleet")
    summary = summarise(results, files)
    write(results, summary, folder, files)
    return folder, results, summary


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_page_says_what_changed_and_whose_the_gap_is(written):
    page = (written[0] / "report.html").read_text(encoding="utf-8")
    assert "t3: aileron power" in page
    assert "the others are unchanged" in page
    assert "new servo" in page
    assert "motor lag (cdrw): The simulator lacks it: all tails share it" in page
    assert re.search(r"time constant 0\.\d+ \(0\.\d+ to 0\.\d+\) s<", page)
    assert "motor_lag" not in page
    assert "no &lt;air&gt; data" in page
    assert 'href="flights/t3-20/report.html"' in page


def test_the_page_draws_what_is_open_without_a_complaint(written, browse):
    page = browse(written[0] / "report.html")
    assert page.complaints == []
    assert page.drawn == 1  # the drift; forest plots wait until they are opened
    assert page.plots == 5


def test_tables_hold_every_weight_and_the_drift(written):
    folder, results, summary = written
    weights = rows_of(folder / "fleet_weights.csv")
    assert len(weights) == sum(len(flight.names) for flight in results.flights)
    assert 0.0 < float(weights[0]["weight"]) < 1.0
    assert [row["tail"] for row in rows_of(folder / "drift.csv") if row["significant"] == "true"] == ["t3"]
    assert {row["account"] for row in rows_of(folder / "pooled_causes.csv")} == {"simulator"}
    population = rows_of(folder / "population.csv")[0]
    assert float(population["mean"]) == summary.populations["cdrw", population["derivative"]].fit.mean


def test_parquet_holds_what_the_csv_holds(written):
    parquet = pytest.importorskip("pyarrow.parquet")
    for name in ("fleet_weights", "population", "tails", "drift", "pooled_causes"):
        table, rows = parquet.read_table(written[0] / f"{name}.parquet"), rows_of(written[0] / f"{name}.csv")
        assert table.column_names == list(rows[0])
        assert table.num_rows == len(rows)


def test_each_tail_has_an_aircraft_file_with_the_fleets_values(written):
    folder, _, summary = written
    read = load_aircraft(folder / "tails" / "t3.yaml")
    prior = summary.priors["cdrw", "t3"]["Cl_da"]
    assert (read.derivatives["Cl_da"].value, read.derivatives["Cl_da"].tolerance) == (prior.value, prior.tolerance)


def test_where_too_few_tails_are_compared_the_page_says_so(written, tmp_path):
    said = "No tail is compared here: that takes three other tails"
    assert said not in (written[0] / "report.html").read_text(encoding="utf-8")
    results = FleetResults(tuple(fleet(tails=3)), (), ())
    write(results, summarise(results), tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert said in page
    assert "too few tails to compare it with" in page
    assert "No tail drifts. Too few tails to compare one with the others. No flight was diagnosed, so" in page
    assert "None stands out" not in page


def test_a_tails_file_keeps_what_its_own_file_says_of_its_mass(written, tmp_path):
    heavy = replace(load_aircraft("cdrw"), mass=4.4)
    files = {"cdrw": load_aircraft("cdrw")}
    write(written[1], written[2], tmp_path, files, {("cdrw", "t3"): heavy})
    masses = [load_aircraft(tmp_path / "tails" / f"{tail}.yaml").mass for tail in ("t2", "t3")]
    assert masses == [4.0, 4.4]


def test_a_drift_in_a_technicians_words(written):
    drift = written[2].drifts["cdrw", "t3", "Cl_da"]
    course = replace(drift.course, kind="step", since=START.timestamp() / DAY)
    drift = replace(drift, course=course, before=0.2, change=-0.036, error=0.004)
    assert (
        tail_sentence("t3", [drift])
        == "t3: aileron power \u221218\u202f% since 1 January 2026; the others are unchanged."
    )


def test_two_types_may_have_a_tail_of_the_same_name(tmp_path):
    """Each keeps its own drift, maintenance, sentence and aircraft file."""
    both = [replace(f, aircraft=aircraft, flight=f"{aircraft}/{f.flight}")
            for aircraft, worn in (("cdrw", "t3"), ("kestrel", None))
            for f in fleet(worn=worn, wear=-0.04, tails=5)]  # fmt: skip
    note = MaintenanceNote("t3", START.replace(month=3, day=15), "new servo", "kestrel")
    files = {name: load_aircraft(name) for name in ("cdrw", "kestrel")}
    results = FleetResults(tuple(sorted(both, key=lambda f: (f.tail, f.date))), (), (note,))
    report = FleetReport(results, summarise(results, files), files)
    assert [(d.aircraft, d.tail, d.name) for d in report.drifts] == [("cdrw", "t3", "Cl_da")]
    (sentence,) = findings(report)
    assert sentence.startswith("t3 (cdrw): aileron power")
    assert "new servo" not in sentence
    assert report.maintenance("cdrw", "t3") == []
    write(results, report.summary, tmp_path, files)
    values = {
        name: load_aircraft(tmp_path / "tails" / f"{name}-t3.yaml").derivatives["Cl_da"].value
        for name in ("cdrw", "kestrel")
    }
    assert values["cdrw"] == pytest.approx(values["kestrel"] - 0.04, abs=0.015)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count('id="tail-cdrw-t3"') == page.count('id="tail-kestrel-t3"') == 1


def test_dates_and_names():
    assert date_words(20576.0) == "3 May 2026"
    assert file_name("../x/7") == "_x_7"


def test_a_folder_that_cannot_be_written(written, tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write(written[1], written[2], tmp_path / "absent" / "folder")
