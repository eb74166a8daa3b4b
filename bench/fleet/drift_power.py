"""How often one tail's change is found, beside what no test can exceed; and how often chance passes for one.

    python -m bench.fleet.drift_power [--draws 400] [--page docs/results/fleet.md]

One derivative of ten tails, drawn as in `drawn_fleets`: 10 to 15 flights a tail over a year, statistical errors of 3 %
(one in seven 12 %), a scatter of flights of 1.5 %. One tail changes. It is found where its p-value is at most what
Benjamini & Hochberg's procedure asks of the third of 200 tests. The bound is a test that knows the course, its date and
all scatters beforehand, and needs no search: the most powerful one by Neyman and Pearson's lemma.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy import stats

from bench.fleet.drawn_fleets import FLIGHT_SCATTER, STATISTICAL, SYSTEMATIC, TAIL_SCATTER, WEAR
from bench.pages import publish, table
from sysid_node.fleet.statistics.drift import find_drift
from sysid_node.fleet.statistics.false_discovery import FALSE_RATE
from sysid_node.fleet.statistics.random_effects import flight_scatter_of_others
from sysid_node.fleet.statistics.series import DerivativeSeries
from sysid_node.flight.record import Array

TAILS, TESTS, CALLED = 10, 200, 3
LIMIT = FALSE_RATE * CALLED / TESTS
#: What happens to the first tail: its course over days (n,), given the day of something that is done to it.
CASES: dict[str, tuple[Callable[[Array, float], Array], bool]] = {
    "loses 18 % little by little over the year": (lambda day, _: -WEAR * day / 365, False),
    "loses 20 % little by little": (lambda day, _: -0.20 * day / 365, False),
    "loses 22 % little by little": (lambda day, _: -0.22 * day / 365, False),
    "loses 25 % little by little": (lambda day, _: -0.25 * day / 365, False),
    "loses 15 % on a day": (lambda day, since: -0.15 * (day >= since), False),
    "loses 15 % on a day, with a maintenance note": (lambda day, since: -0.15 * (day >= since), True),
}


def drawn(seed: int, course: Callable[[Array, float], Array] | None) -> tuple[DerivativeSeries, float, Array]:
    """The series of a type, the day of what is done to its first tail, and the change (n,) of that tail's flights."""
    rng = np.random.default_rng([seed, 26])
    counts = rng.integers(10, 16, TAILS)
    tail, n = np.repeat(np.arange(TAILS), counts), int(counts.sum())
    day = np.concatenate([np.sort(rng.uniform(0, 365, count)) for count in counts])
    error = STATISTICAL * np.where(rng.random(n) < 0.15, 4.0, 1.0) * np.exp(0.3 * rng.standard_normal(n))
    value = 1.0 + TAIL_SCATTER * rng.standard_normal(TAILS)[tail] + FLIGHT_SCATTER * rng.standard_normal(n)
    since = float(rng.uniform(120, 240))
    change = np.zeros(counts[0]) if course is None else course(day[: counts[0]], since)
    value[: counts[0]] += change
    names = tuple(f"tail {j}" for j in range(TAILS))
    series = DerivativeSeries(
        "type", "Cl_da", names, tail, value + error * rng.standard_normal(n), error, np.full(n, SYSTEMATIC), day,
        tuple(map(str, range(n))), ("",) * n,
    )  # fmt: skip
    return series, since, change


def p_value(series: DerivativeSeries, notes: Sequence[float]) -> float:
    """The p-value of the first tail's drift."""
    scatter = flight_scatter_of_others(series.value, series.statistical, series.systematic, series.tail)
    drift = find_drift(series.of_tail("tail 0"), float(scatter.value[0]), int(scatter.freedom[0]), notes)
    assert drift is not None
    return drift.p_value


def bound(series: DerivativeSeries, change: Array) -> float:
    """The p-value of the test that knows all but the level and the size of the change."""
    tail = series.of_tail("tail 0")
    weight = 1.0 / (tail.statistical**2 + FLIGHT_SCATTER**2)
    centred = change - np.average(change, weights=weight)
    information = float(weight @ centred**2)
    return float(2.0 * stats.norm.sf(abs(weight @ (centred * tail.value)) / np.sqrt(information)))


def power(draws: int) -> str:
    """How often each change is found, and by the bound."""
    rows = []
    for name, (course, noted) in CASES.items():
        found = best = 0
        for seed in range(draws):
            series, since, change = drawn(seed, course)
            found += p_value(series, [since] if noted else []) <= LIMIT
            best += bound(series, change) <= LIMIT
        rows.append((name, f"{100 * found / draws:.0f} %", f"{100 * best / draws:.0f} %"))
    return table((f"a tail, {draws} draws each", "found", "by a test that knows the course"), rows)


def false_alarms(draws: int) -> str:
    """How often chance gives a p-value as small as stated."""
    p = np.array([p_value(series, [since]) for series, since, _ in (drawn(10**6 + k, None) for k in range(draws))])
    rows = [(f"{level:g}", f"{draws * level:.1f}", str(int((p <= level).sum()))) for level in (0.05, 0.01, 0.001)]
    return table((f"p-value at most, {draws} tails without a change", "expected", "found"), rows)


def main() -> None:
    """Print the tables, or put them into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=400)
    parser.add_argument("--page", type=Path)
    args = parser.parse_args()
    publish("bench/fleet/drift_power.py", f"{power(args.draws)}\n\n{false_alarms(5 * args.draws)}", args.page)


if __name__ == "__main__":
    main()
