"""How far the sizes that ``sysid gap`` states are off, beside the standard errors that chance alone gives them.

    python -m bench.gap.size_errors bench/withheld/ledgers/seeds_820.jsonl bench/withheld/ledgers/seeds_1200.jsonl \
        [--page docs/results/gap_calibration.md]

Reads ledgers of ``bench/gap/scoreboard.py``: the sizes of the effects that were named rightly, and what was drawn. An
aircraft is not its simulator, so sizes are off by more than chance: by a share of themselves, which is learned here and
added in quadrature by ``sysid_node.gap.validation.standard_errors`` (a discrepancy of the model: Kennedy & O'Hagan
(2001), J. R. Stat. Soc. B 63(3)). The share is the one with which 68 % and 95 % intervals hold as nearly as they
should; not the likeliest, which a few sizes that are plainly wrong would rule.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.pages import publish, table
from bench.withheld import ledger
from sysid_node.gap.thresholds import THRESHOLDS

Array = NDArray[np.float64]

#: The share in use.
_IN_USE = THRESHOLDS.validation.discrepancy

#: Standard errors to either side, and how often such an interval should hold.
_LEVELS = ((1.0, 0.683), (1.96, 0.95))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+", type=Path, help="ledgers of sets")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    publish("bench/gap/size_errors.py", page({path.name: list(sizes(path)) for path in args.sets}), args.page)


def sizes(path: Path) -> Iterator[tuple[bool, float, float, float]]:
    """Of each size of a ledger: whether the air was still, what was drawn, what was found, and its standard error."""
    for case in ledger.read(path).values():
        if case.kind in ("one", "two") and case.right:
            for _, true, found, error in case.parameters:
                yield case.label["turbulence"] == "none", true, found, error


def learned(true: Array, found: Array, error: Array) -> float:
    """Share (0 to 0.2) of a size by which it is off beyond chance; all (n,)."""
    shares = np.linspace(0.0, 0.2, 401)
    worst = [max(abs(held(true, found, error, s, k) - wanted) for k, wanted in _LEVELS) for s in shares]
    return float(shares[int(np.argmin(worst))])


def held(true: Array, found: Array, error: Array, share: float, width: float) -> float:
    """How often ``width`` standard errors hold the truth, a share of the size among them; all (n,)."""
    return float(np.mean(np.abs(found - true) <= width * np.hypot(error, share * found)))


def page(sets: dict[str, Sequence[tuple[bool, float, float, float]]]) -> str:
    """The section of the documentation."""
    rows = []
    for name, known in sets.items():
        for words, still in (("still air", True), ("turbulence", False)):
            columns = _columns([row for row in known if row[0] == still])
            shown = [f"{100 * held(*columns, s, k):.0f} %" for s in (0.0, _IN_USE) for k, _ in _LEVELS]
            rows.append([f"{name}, {words}", str(columns[0].size), *shown])
    share = learned(*_columns([row for known in sets.values() for row in known]))
    heads = ("set", "sizes", "68 % interval, by chance alone", "95 %", "68 %, as stated", "95 %")
    return "\n\n".join([table(heads, rows), f"Share learned from all of these: {share:.4f}; in use: {_IN_USE:g}."])


def _columns(known: Sequence[tuple[bool, float, float, float]]) -> tuple[Array, Array, Array]:
    true, found, error = np.array([row[1:] for row in known]).reshape(-1, 3).T
    return true, found, error


if __name__ == "__main__":
    main()
