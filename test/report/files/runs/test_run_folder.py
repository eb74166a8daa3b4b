"""A run's folder gives the same run and the same page back."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import synthetic

from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.report.files.runs.run_folder import read_run, rebuild_report, summary, write_run
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.results.signals import RunSignals


def test_rebuilt_report_equals_the_first(tmp_path):
    run = synthetic.run()
    write_run(tmp_path, run)
    first = (tmp_path / "report.html").read_bytes()
    (tmp_path / "report.html").unlink()
    assert rebuild_report(tmp_path).read_bytes() == first
    assert read_run(tmp_path).final == run.final


def test_a_long_record_is_thinned_the_same_both_times(tmp_path):
    run = synthetic.run(seconds=600.0, rate=200.0, publish_rate=0.5)
    write_run(tmp_path, run)
    first = (tmp_path / "report.html").read_bytes()
    assert len(first) < 8e6
    assert rebuild_report(tmp_path).read_bytes() == first


def test_run_of_almost_nothing_goes_both_ways(tmp_path):
    write_run(tmp_path / "new" / "folder", RunResult("kestrel", "sls_rft", []))
    assert sorted(p.name for p in (tmp_path / "new" / "folder").iterdir()) == ["report.html", "summary.json"]
    back = read_run(tmp_path / "new" / "folder")
    assert back.final is None
    assert math.isnan(back.data.seconds)


def test_files_of_an_earlier_run_do_not_linger(tmp_path):
    write_run(tmp_path, synthetic.run(seconds=10.0))
    write_run(tmp_path, RunResult("kestrel", "sls_rft", []))
    assert read_run(tmp_path).signals.flight is None


def test_summary_keeps_to_the_contract():
    content = summary(synthetic.run(seconds=10.0))
    assert content["rejected"]["air_data: not finite"] == 12
    errors = {"standard_error", "statistical_error", "systematic_error"}
    assert set(content["derivatives"]["Cm_alpha"]) == {"value", *errors, "lower", "upper", "valid", "status"}
    assert {"servos", "budget"} <= set(content)
    assert {"r_squared", "residual_std"} <= set(content["fits"]["Cm"])
    keys = {"aircraft", "method", "data_seconds", "samples", "rejected", "settings", "derivatives", "fits", "holdout"}
    assert keys <= set(content)


def test_summary_is_strict_json_without_nan():
    run = synthetic.run(seconds=2.0)  # before anything is known
    unknown = replace(
        run, data=replace(run.data, seconds=math.nan), settings={"window": np.float64(math.inf), "lines": np.arange(2)}
    )
    content = json.loads(json.dumps(summary(unknown), allow_nan=False))
    assert content["derivatives"]["Cm_alpha"]["value"] is None
    assert content["data_seconds"] is None
    assert content["settings"] == {"window": None, "lines": [0, 1]}


def test_references_of_what_was_not_estimated_are_left_out(tmp_path):
    run = synthetic.run(seconds=10.0)
    write_run(
        tmp_path, replace(run, references=replace(run.references, truth={**run.references.truth, "CL_flaps": 1.0}))
    )
    assert read_run(tmp_path).references.truth == run.references.truth


@pytest.mark.parametrize(
    ("text", "wrong"),
    [(None, r"no summary\.json in it"), ("{", "cannot be read as JSON"), ("[]", "'aircraft' and 'method'")],
)
def test_a_folder_that_holds_no_run_is_named(tmp_path, text, wrong):
    if text is not None:
        (tmp_path / "summary.json").write_text(text)
    with pytest.raises(InputError, match=wrong) as error:
        read_run(tmp_path)
    assert "\n" not in str(error.value)


def test_a_summary_with_a_damaged_key_is_one_line(tmp_path):
    run = synthetic.run(seconds=10.0)
    write_run(tmp_path, run)
    found = json.loads((tmp_path / "summary.json").read_text())
    found["servos"] = {"elevator": {"value": 0.03, "sutats": "ok"}}
    (tmp_path / "summary.json").write_text(json.dumps(found))
    with pytest.raises(InputError, match="its files are damaged"):
        read_run(tmp_path)


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_run(tmp_path / "file" / "out", RunResult("kestrel", "sls_rft", []))


def test_estimates_out_of_order_are_refused():
    run = synthetic.run(seconds=10.0)
    with pytest.raises(InputError, match="out of order"):
        replace(run, history=run.history[::-1])


def test_flight_without_columns(tmp_path):
    write_run(tmp_path, RunResult("kestrel", "sls_rft", [], signals=RunSignals(FlightRecord(np.arange(3.0), {}))))
    assert read_run(tmp_path).signals.flight.duration == 2.0
