"""How far the surfaces' movements explain the motion, where an autopilot moves them with the gusts and where not.

    python -m bench.estimation.answering_surfaces --page docs/research/identifier.md

Each measured regressor is correlated with its instrument, the response of the file's aircraft to the surfaces. Where
the surfaces drive the motion the two agree. Where they answer gusts, the gusts drive it. Beside it: the derivatives of
the rolling moment over what they are.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from bench.estimation.changes import AIRCRAFT, DOUBLETS, KNOWN, REPEATED
from bench.estimation.convergence import ALL
from bench.estimation.judging import Array, processes
from bench.estimation.simulated_flights import Setting, fly
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.online.replay import run_to_end
from sysid_node.online.settings import OnlineSettings

REGRESSORS = ("alpha", "q", "beta", "p", "r")
ROLLING = ("Cl_p", "Cl_da")
SEEDS = (1, 2, 3)
MINUTES = 5
SELDOM = tuple(doublet.replace(f"repeat={REPEATED}", f"repeat={MINUTES - 1}") for doublet in DOUBLETS)


def settings(turbulence: str) -> Mapping[str, Setting]:
    """The flights by name."""
    sines = f"multisine:{ALL}:length=20:low=0.1:high=2:start=0.7:every=20:repeat=2"
    return {
        "autopilot, a doublet a minute": Setting("", turbulence, manoeuvre=SELDOM, seconds=60.0 * MINUTES),
        "autopilot, 3-2-1-1s": Setting("", turbulence),
        "autopilot, multisines": Setting("", turbulence, manoeuvre=(sines,)),
        "no autopilot, doublets": Setting("", turbulence, autopilot=False),
    }


def looked_at(setting: Setting, seed: int) -> Array:
    """Of one flight: the correlation of each regressor with its instrument, then derivatives over what they are."""
    batch = fly(AIRCRAFT, setting, [seed])
    history, state = run_to_end(
        load_aircraft(AIRCRAFT), OnlineSettings(), batch.time, batch.samples[0], batch.time[-1:]
    )
    layout, gram = state.model.layout, state.finished.information.grams.sum(axis=0)
    pairs = [(layout.column(name), layout.column(f"{name} instrument")) for name in REGRESSORS]
    correlations = [gram[i, j] / np.sqrt(gram[i, i] * gram[j, j]) for i, j in pairs]
    last = history[-1].derivatives
    return np.array([*correlations, *(last[name].value / KNOWN[name] for name in ROLLING)])


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    rows = []
    with processes() as pool:
        for turbulence in ("light", "moderate"):
            for name, setting in settings(turbulence).items():
                found = np.array(list(pool.map(partial(looked_at, setting), SEEDS)))
                cells = [f"{low:.2f} to {high:.2f}" for low, high in zip(found.min(0), found.max(0), strict=True)]
                rows.append([f"{turbulence}; {name}", *cells])
    heads = ("air; flight", *REGRESSORS, *(f"`{name}` over the truth" for name in ROLLING))
    publish("bench/estimation/answering_surfaces.py", table(heads, rows), args.page)


if __name__ == "__main__":
    main()
