"""Judged cases in a file. Truth: the cases that were put in."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from bench.withheld import judging, ledger

LABEL = {"seed": 7, "plant": "cdfp", "kind": "one", "turbulence": "none", "programme": "steps", "servo_lag": 0.007,
         "effects": {"actuator_lag": {"time_constant": 0.08}}}  # fmt: skip
CAUSE = {"effect": "actuator_lag", "indistinguishable_from": [], "probability": 0.9,
         "parameters": {"time_constant": [0.083, 0.002]},
         "grounds": {"log_bayes_factor": 120.0, "misspecification": 0.1}}  # fmt: skip
GAP = {"before": 0.5, "after": 0.1, "noise_floor": 0.09, "shrink_percent": 97.0, "ci95": [90.0, 99.0]}
SAID = {"verdict": "explained", "causes": [CAUSE], "doubted": [], "gap": GAP}


@pytest.fixture
def judged() -> judging.Judged:
    return replace(judging.judge(LABEL, SAID), flown={"before": 0.5, "after": 0.1, "true_effect": 0.09})


def test_what_was_judged_is_read_again(tmp_path: Path, judged: judging.Judged) -> None:
    file = tmp_path / "final.jsonl"
    ledger.add(file, judged, list(ledger.weighed_by(LABEL, SAID)))
    ledger.add(file, replace(judged, label={**LABEL, "seed": 8}), [])
    known = ledger.read(file)
    assert list(known) == [7, 8]
    again = known[7]
    assert judging.line(again) == judging.line(judged)
    assert (again.closed_of_true, again.covers, again.sized) == (judged.closed_of_true, judged.covers, judged.sized)
    assert list(ledger.causes(file)) == [(7, ("actuator_lag", 120.0, 0.1, True))]


def test_no_file_holds_no_case(tmp_path: Path) -> None:
    assert ledger.read(tmp_path / "none.jsonl") == ledger.read(None) == {}


def test_a_diagnosis_that_failed_is_kept_as_wrong(tmp_path: Path) -> None:
    file = tmp_path / "final.jsonl"
    ledger.add(file, judging.judge(LABEL, judging.FAILURE), list(ledger.weighed_by(LABEL, judging.FAILURE)))
    assert not ledger.read(file)[7].right
    assert json.loads(file.read_text())["weighed"] == []


def test_a_ledger_holds_one_version(tmp_path: Path, judged: judging.Judged) -> None:
    file = tmp_path / "final.jsonl"
    ledger.add(file, judged, [])
    assert list(ledger.read(file, ledger.version())) == [7]
    with pytest.raises(ValueError, match=r"cases of versions \w+, \w+; a set is one's"):
        ledger.read(file, "0" * 12)
    ledger.add(file, replace(judged, label={**LABEL, "seed": 8}), [], by="f" * 12)
    with pytest.raises(ValueError, match="take another file"):
        ledger.read(file)
