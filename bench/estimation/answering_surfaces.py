"""How strongly instruments are correlated with gusts where an autopilot moves the surfaces, and what is allowed for.

    python -m bench.estimation.answering_surfaces --page docs/research/identifier.md

Each aircraft flies five minutes, moved much, little, or by hand. Of the equation of the rolling moment: the energy of
the gusts' moments over that of the moments by deflections, the correlation of what the true derivatives leave with the
instruments, and the correlation that the estimator allows for. Then of all derivatives how many are valid, and of these
how many intervals hold the truth.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from bench.estimation.convergence import ALL, PEAKS
from bench.estimation.judging import FAR, Array, exact, processes
from bench.estimation.simulated_flights import Setting, fly
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.online.regression import gust_correlation, least_squares
from sysid_node.online.replay import run_to_end
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.types import Estimates

AIRCRAFT = ("cdrw", "kestrel")
COEFFICIENT = "Cl"
SEEDS = (1, 2, 3)
SECONDS = 300.0


def doublets(every: float, seconds: float = SECONDS) -> tuple[str, ...]:
    """One on each surface in turn, as often as it fits into a flight of so many s."""
    count = int((seconds - 10.0) / every)
    return tuple(
        f"doublet:{surface}:amplitude={peak}:width=0.35:start={5.0 + i * every / 3.0}:every={every}:repeat={count}"
        for i, (surface, peak) in enumerate(PEAKS.items())
    )


def multisines(share: float, seconds: float = SECONDS) -> tuple[str, ...]:
    """On all surfaces at once, with a ``share`` of the usual peaks, as often as it fits into a flight of so many s."""
    peaks = ",".join(f"{share * peak:.3g}" for peak in PEAKS.values())
    surfaces, count = ALL.split(":")[0], int((seconds - 10.0) / 20.0)
    return (f"multisine:{surfaces}:amplitude={peaks}:length=20:low=0.1:high=2:start=0.7:every=20:repeat={count}",)


FLIGHTS: Mapping[str, Setting] = {
    "autopilot, doublets every 60 s": Setting("", manoeuvre=doublets(60.0)),
    "autopilot, doublets every 20 s": Setting("", manoeuvre=doublets(20.0)),
    "autopilot, doublets every 6 s": Setting("", manoeuvre=doublets(6.0)),
    "autopilot, multisines of a third": Setting("", manoeuvre=multisines(1.0 / 3.0)),
    "autopilot, multisines": Setting("", manoeuvre=multisines(1.0)),
    "autopilot, 3-2-1-1s": Setting(""),
    "no autopilot, doublets": Setting("", autopilot=False),
}


def looked_at(aircraft: str, setting: Setting, seed: int) -> Array:
    """(7,) of one flight: what ``correlations`` and ``judged`` find."""
    batch, known = fly(aircraft, setting, [seed]), exact(load_aircraft(aircraft))
    history, state = run_to_end(known, OnlineSettings(), batch.time, batch.samples[0], batch.time[-1:])
    return np.array([*correlations(state), *judged(known, history[-1])])


def correlations(state: EstimatorState) -> tuple[float, float, float]:
    """Of ``COEFFICIENT``: ratio of energies, mean squared correlation beyond chance with an instrument, allowed one."""
    latest, equations = state.latest, state.equations
    assert latest is not None
    c, gram = equations.structure.coefficients.index(COEFFICIENT), latest.total.grams.sum(axis=0)
    sensed = state.changes.monitor.references[-1].sensed
    gusts = gust_correlation.share_of_gusts(latest.uncertainty.density, sensed)
    answered = float(gust_correlation.of_solution(equations, latest.solution, gram, gusts)[c])
    left = least_squares.residual_combinations(equations, _truth(state))[:, c]
    own = equations.structure.unknowns(c)
    Z = equations.instruments[own]
    score = gram[Z] @ left
    explained = float(score @ np.linalg.solve(gram[np.ix_(Z, Z)], score)) / float(left @ gram @ left)
    each = explained / own.size - 1.0 / float(latest.uncertainty.freedom[c])
    return (answered / gust_correlation.ANSWERED) ** 2, each, max(answered, gust_correlation.ALLOWED)


def _truth(state: EstimatorState) -> Array:
    """(P, C) the aircraft file's derivatives, which are what was flown."""
    known, table = state.model.aircraft.derivatives, state.model.table
    theta = np.zeros((state.equations.columns.size, state.equations.outputs.size))
    for name, unknown, c, offset in zip(table.names, table.unknown, table.coefficient, table.offset, strict=True):
        if not offset:
            theta[unknown, c] = known[name].value
    return theta


def judged(known: Aircraft, estimates: Estimates) -> tuple[int, int, int, int]:
    """How many derivatives there are, are valid, and of these hold the truth, and are far off."""
    truths = [(estimates.derivatives[name], d.value) for name, d in known.derivatives.items()]
    valid = [(d, truth) for d, truth in truths if d.valid]
    hold = sum(d.lower <= truth <= d.upper for d, truth in valid)
    return len(truths), len(valid), hold, sum(abs(d.value - truth) > FAR * d.standard_error for d, truth in valid)


def row(name: str, found: Array) -> list[str]:
    """Of several flights (F, 7)."""
    ratio, squared, allowed = found[:, :3].mean(axis=0)
    count, valid, hold, far = found[:, 3:].sum(axis=0)
    shares = f"{100 * valid / count:.0f} %", f"{100 * hold / max(valid, 1):.1f} %", f"{100 * far / max(valid, 1):.1f} %"
    return [name, f"{ratio:.2f}", f"{math.sqrt(max(squared, 0.0)):.2f}", f"{allowed:.2f}", *shares]


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    rows = []
    with processes() as pool:
        for aircraft, turbulence in product(AIRCRAFT, ("light", "moderate")):
            for name, setting in FLIGHTS.items():
                flown = replace(setting, turbulence=turbulence, seconds=SECONDS)
                found = np.array(list(pool.map(partial(looked_at, aircraft, flown), SEEDS)))
                rows.append(row(f"{aircraft}, {turbulence}; {name}", found))
    heads = ("flights", "gusts over deflections", "correlation", "allowed", "valid", "hold", "> 4 s.e.")
    publish("bench/estimation/answering_surfaces.py", table(heads, rows), args.page)


if __name__ == "__main__":
    main()
