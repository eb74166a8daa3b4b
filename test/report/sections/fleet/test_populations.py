"""Scatters on a fleet's page. Truth: the fit that is shown."""

from dataclasses import replace

import pytest
from fleet_flights import fleet

from sysid_node.fleet.results import FleetResults
from sysid_node.fleet.statistics.random_effects import Scatter
from sysid_node.fleet.statistics.summarise import summarise
from sysid_node.report.results.fleet_report import FleetReport
from sysid_node.report.sections.fleet import populations

RESULTS = FleetResults(tuple(fleet(tails=3)), (), ())


def shown(scatter: Scatter) -> str:
    """How a scatter of tails, as a share of the mean, is written."""
    summary = summarise(RESULTS)
    key, population = next((k, p) for k, p in summary.populations.items() if not k[1].endswith("_0"))
    size = abs(population.fit.mean)
    tails = Scatter(*(size * x for x in (scatter.value, scatter.lower, scatter.upper)))
    changed = replace(population, fit=replace(population.fit, tails=tails))
    report = FleetReport(RESULTS, replace(summary, populations={key: changed}))
    ((_, (row,)),) = populations.context(report)["types"]
    return str(row["tails"]).replace("\u202f", " ")


@pytest.mark.parametrize(
    ("scatter", "text"),
    [
        (Scatter(6.8e-7, 0.0, 0.51), "0 % (0 to 51)"),
        (Scatter(0.03, 2e-9, 0.51), "3.0 % (0 to 51)"),
        (Scatter(0.03, 0.01, 0.51), "3.0 % (1.0 to 51)"),
        (Scatter(6.8e-7, 0.0, 2.0e-6), "6.8 × 10⁻⁵ % (0 to 2.0 × 10⁻⁴)"),
        (Scatter(0.03, 0.01, float("inf")), "3.0 % (1.0 to ∞)"),
        (Scatter(float("nan"), float("nan"), float("nan")), "–"),
    ],
)
def test_a_scatter_far_below_its_interval_is_written_as_none(scatter: Scatter, text: str) -> None:
    assert shown(scatter) == text
