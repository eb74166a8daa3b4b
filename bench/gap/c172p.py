"""What JSBSim's c172p has that its aircraft file does not hold.

    python -m bench.gap.c172p [--page FILE]

The plant of the withheld effects with nothing added, in still air, with ideal instruments: its coefficients against
those of the file, whose derivatives are right at the trim. What derivatives leave when they are fitted without limits
is nobody's error but the linear file's, and terms are added one by one to see whose.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from bench.pages import publish, table
from bench.withheld.drawing import FOREIGN, SETS, draw
from bench.withheld.mattering import coefficients
from bench.withheld.plants.plant import RATE, Plant

Array = NDArray[np.float64]

#: Terms that the equations and tables of the model have beside derivatives, by coefficient.
TERMS = {
    "CL": ("rate of alpha",),
    "CD": ("size of sideslip", "square of alpha", "size of elevator"),
    "CY": ("alpha times roll rate", "alpha times yaw rate"),
    "Cl": ("alpha: lift on an arm to the side", "alpha times yaw rate"),
    "Cm": ("propeller wash over the elevator", "rate of alpha"),
    "Cn": ("propeller wash over the rudder",),
}

#: Band that is compared, Hz.
_BAND = 4.0


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=3, help="manoeuvres drawn, one flight each")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    rows = _rows([_remainders(seed) for seed in _seeds(args.flights)])
    heads = ("coefficient", "the file leaves", "its derivatives refitted", "with this term more", "it leaves")
    publish("bench/gap/c172p.py", table(heads, rows), args.page)


def _seeds(count: int) -> list[int]:
    """Of the development set, with this plant."""
    seeds = (seed for seed in range(1, 1000) if draw("development", seed).plant == FOREIGN)
    return [seed for seed, _ in zip(seeds, range(count), strict=False)]


def _remainders(seed: int) -> dict[str, list[float]]:
    """By coefficient: power of the motion, what the file leaves, what refitted derivatives do, and with each term."""
    case = replace(draw("development", seed), turbulence="none", effects={})
    plant = Plant(case, next(iter(SETS)))
    log = plant.fly({}, 0)
    found, x = coefficients(plant.truth, plant.seen(log, {}), log.commands, log.density, RATE)
    terms = _terms(plant, x, log.commands, log.density, plant.seen(log, {})[:, 9])
    low = butter(4, _BAND, fs=RATE, output="sos")
    result = {}
    for i, (coefficient, names) in enumerate(TERMS.items()):
        own = {
            n.partition("_")[2]: d.value for n, d in plant.truth.derivatives.items() if n.startswith(f"{coefficient}_")
        }
        known = sosfiltfilt(low, np.column_stack([x[r] for r in own]), axis=0)
        motion = sosfiltfilt(low, found[:, i])
        more = [sosfiltfilt(low, terms[name]) for name in names]
        left = [motion - motion.mean(), motion - known @ list(own.values())]
        left += [_left(motion, [*known.T, *more[:count]]) for count in range(len(more) + 1)]
        result[coefficient] = [float(np.mean(series**2)) for series in left]
    return result


def _terms(plant: Plant, x: dict[str, Array], commands: Array, density: Array, airspeed: Array) -> dict[str, Array]:
    """The terms as regressors (N,)."""
    geometry = plant.truth.geometry
    alpha = x["alpha"] - x["alpha"].mean()
    wash = commands[:, -1] / (0.5 * density * airspeed**2 * geometry.S)  # the thrust coefficient
    return {
        "rate of alpha": np.gradient(x["alpha"], 1.0 / RATE) * 0.5 * geometry.cbar / airspeed,
        "size of sideslip": np.abs(x["beta"]),
        "square of alpha": alpha**2,
        "size of elevator": np.abs(x["de"]),
        "alpha times roll rate": alpha * x["p"],
        "alpha times yaw rate": alpha * x["r"],
        "alpha: lift on an arm to the side": alpha,
        "propeller wash over the elevator": wash * x["de"],
        "propeller wash over the rudder": wash * x["dr"],
    }


def _left(series: Array, columns: Sequence[Array]) -> Array:
    """What of a series least squares on columns leave."""
    matrix = np.column_stack(columns)
    return np.asarray(series - matrix @ np.linalg.lstsq(matrix, series, rcond=None)[0])


def _rows(flights: Sequence[dict[str, list[float]]]) -> list[list[str]]:
    """Shares of the motion, all flights together."""
    rows = []
    for coefficient, names in TERMS.items():
        motion, filed, *left = np.sum([flight[coefficient] for flight in flights], axis=0)
        shares = [f"{100.0 * np.sqrt(power / motion):.1f} %" for power in (filed, *left)]
        for place, name in enumerate(names):
            first = (coefficient, shares[0], shares[1]) if place == 0 else ("", "", "")
            rows.append([*first, name, shares[2 + place]])
    return rows


if __name__ == "__main__":
    main()
