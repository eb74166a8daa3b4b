"""The content of gap.json; truth: the diagnosis that it is of, and the contract's keys."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.document import document, parameters, ranked
from sysid_node.gap.validation.standard_errors import standard_errors
from sysid_node.report.sections.gap.candidates import candidates


def test_the_document_is_json_and_its_shares_add_up(lagging) -> None:
    found = json.loads(json.dumps(document(lagging), allow_nan=False))
    assert sum(w["share"] for w in found["where"]) == pytest.approx(1.0)
    assert {"verdict", "gap", "where", "causes", "unexplained", "next_flight"} <= found.keys()


def test_what_is_doubted_is_told(lagging) -> None:
    attribution = replace(lagging.attribution, causes=(), rejected=lagging.attribution.causes)
    found = replace(lagging, attribution=attribution)
    assert [c["effect"] for c in document(found)["doubted"]] == ["actuator_lag"]
    assert document(found)["doubted"][0]["parameters"] == document(lagging)["causes"][0]["parameters"]
    assert re.match(
        r"actuator lag \(probability over 0\.99; all controls 0\.0[78]\S* ± \S+ s\)", candidates(found)["doubted"]
    )
    assert not candidates(lagging)["doubted"]


def test_the_best_of_the_list_is_not_there_for_that(lagging) -> None:
    (cause,) = lagging.attribution.causes
    best, *others = document(lagging)["candidates"]
    assert (best["effect"], best["probability"]) == ("actuator_lag", cause.probability)
    assert best["share"] + sum(c["share"] for c in others) == pytest.approx(1.0)
    found = replace(lagging, attribution=replace(lagging.attribution, causes=(), rejected=()))
    best, *others = document(found)["candidates"]
    assert best["share"] > 0.9 and {c["probability"] for c in (best, *others)} == {None}


def test_a_cause_has_the_keys_of_the_contract(lagging) -> None:
    (cause,) = document(lagging)["causes"]
    assert {"effect", "parameters", "probability", "gap_after", "indistinguishable_from"} <= cause.keys()
    expected = {"share", "log_bayes_factor", "tolerances", "misspecification", "flexible", "imitation"}
    assert cause["grounds"].keys() == expected
    assert cause["gap_after"] == lagging.size.after == document(lagging)["gap"]["after"]


def test_parameters_are_sizes_with_their_standard_errors(lagging) -> None:
    """By chance and by 3 % of the size; the lag is the first of the unknowns."""
    (cause,) = lagging.attribution.causes
    fit = lagging.attribution.size_fit
    value, error = parameters(fit, cause)["elevator"]
    assert value == fit.values[0]
    assert error == pytest.approx(np.hypot(standard_errors(fit)[0], 0.03 * value))


def test_effects_that_were_fitted_alone_are_ranked(lagging) -> None:
    rows = ranked(lagging)
    assert [share for _, _, share in rows] == sorted((share for _, _, share in rows), reverse=True)
    assert "none" in [label for label, _, _ in rows]
