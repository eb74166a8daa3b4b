"""Every threshold says what it is; truth: the benches that learned the values, where one did."""

from dataclasses import replace
from math import log
from pathlib import Path

import pytest

from sysid_node.gap.thresholds import THRESHOLDS, Acceptance, table

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("threshold", list(table()), ids=lambda threshold: threshold.name)
def test_each_has_a_meaning_a_unit_and_a_source(threshold) -> None:
    assert threshold.meaning
    assert threshold.unit or isinstance(threshold.value, frozenset)
    assert threshold.source.startswith("chosen") or (ROOT / threshold.source).is_file()


def test_names_are_distinct_and_values_are_the_ones_in_use() -> None:
    names = [threshold.name for threshold in table()]
    assert len(names) == len(set(names))
    assert dict(zip(names, table(), strict=True))["verdict.told_apart"].value == THRESHOLDS.verdict.told_apart


def test_a_sweep_changes_a_copy() -> None:
    swept = replace(THRESHOLDS, verdict=replace(THRESHOLDS.verdict, told_apart=0.9))
    assert swept.verdict.told_apart == 0.9 != THRESHOLDS.verdict.told_apart


def test_a_search_among_many_effects_costs_the_logarithm_of_their_number() -> None:
    """Bonferroni: odds of 19 to 1 for one effect, 19 n to 1 for the best of n."""
    limits = Acceptance(probability=0.95)
    assert limits.log_bayes_factor(1) == pytest.approx(log(19.0))
    assert limits.log_bayes_factor(40) == pytest.approx(log(19.0 * 40.0))
