"""The weights of ``sysid_node.gap.selection.calibration``, learned from flights of known truth.

    python -m bench.gap.calibration_weights bench/withheld/ledgers/seeds_820.jsonl \
        bench/withheld/ledgers/seeds_1200.jsonl [--page docs/results/gap_calibration.md]

Reads ledgers of ``bench/gap/scoreboard.py`` (or some seeds of them): the grounds of every cause that was named or
doubted, and by the label whether it was there. A logistic regression by Firth's (1993) penalised
likelihood (Biometrika 80(1)): few cases, nearly parted by their grounds, would send the likeliest weights to infinity
(Heinze & Schemper (2002), Statistics in Medicine 21). Held against each case by weights learned from all the others.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bench.pages import publish, table
from bench.withheld import ledger
from bench.withheld.scoreboard import calibration
from sysid_node.gap.selection.calibration import CauseEvidence, is_misspecified, regressors
from sysid_node.gap.thresholds import THRESHOLDS

Array = NDArray[np.float64]

_NAMES = ("a constant", "logarithm of the nats", "an effect that works through the derivatives")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+", help="ledger of a set, or FILE:FIRST-LAST for some of its seeds")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    known = [row for text in args.sets for row in causes(text)]
    found = [row for row in known if not is_misspecified(row[1])]
    X = np.array([regressors(grounds) for _, grounds, _ in found])
    right = np.array([there for _, _, there in found], float)
    refuted = [there for _, grounds, there in known if is_misspecified(grounds)]
    publish("bench/gap/calibration_weights.py", page([case for case, _, _ in found], X, right, refuted), args.page)


def causes(text: str) -> Iterator[tuple[str, CauseEvidence, bool]]:
    """Case, grounds, and whether it was there, of every cause of a ledger."""
    name, _, seeds = text.partition(":")
    first, last = (int(part) for part in seeds.split("-")) if seeds else (0, 10**9)
    for seed, (effect, nats, misspecification, there) in ledger.causes(Path(name)):
        if first <= seed <= last:
            yield (
                f"{name}/{seed}",
                CauseEvidence(nats, misspecification, effect in THRESHOLDS.calibration.flexible_effects),
                there,
            )


def learned(X: Array, right: Array) -> Array:
    """Weights (K,) of a logistic regression on regressors (n, K), by Firth's penalised likelihood."""

    def loss(weights: Array) -> float:
        p = 1.0 / (1.0 + np.exp(-np.clip(X @ weights, -500.0, 500.0)))
        p = np.clip(p, 1e-12, 1.0 - 1e-12)
        _, volume = np.linalg.slogdet((X * (p * (1.0 - p))[:, None]).T @ X)
        return -float(np.sum(right * np.log(p) + (1.0 - right) * np.log(1.0 - p)) + 0.5 * volume)

    options = {"maxiter": 20000, "maxfev": 20000, "xatol": 1e-6, "fatol": 1e-9}
    return np.asarray(minimize(loss, np.zeros(X.shape[1]), method="Nelder-Mead", options=options).x)


def page(cases: Sequence[str], X: Array, right: Array, refuted: Sequence[bool]) -> str:
    """The section of the documentation."""
    weights = learned(X, right)
    rows = [
        [name, f"{w:.2f}", f"{used:.2f}"]
        for name, w, used in zip(_NAMES, weights, THRESHOLDS.calibration.weights, strict=True)
    ]
    unseen = [_of_others(cases, X, right, case) for case in dict.fromkeys(cases)]
    stated = [(float(p), bool(r)) for some in unseen for p, r in some]
    return "\n\n".join(
        [
            f"{len(set(cases))} cases with {len(right)} causes named or doubted, {int(right.sum())} of them there; "
            f"beside them {len(refuted)} whose equation is misspecified, {sum(refuted)} of them there.",
            table(("weight of", "learned", "in use"), rows),
            "Each case by weights learned from all the others:",
            calibration(stated),
        ]
    )


def _of_others(cases: Sequence[str], X: Array, right: Array, case: str) -> list[tuple[float, float]]:
    """Probabilities of a case's causes by the other cases, and whether they were there."""
    own = np.array([c == case for c in cases])
    weights = learned(X[~own], right[~own])
    return list(zip(1.0 / (1.0 + np.exp(-X[own] @ weights)), right[own], strict=True))


if __name__ == "__main__":
    main()
