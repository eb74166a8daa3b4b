"""Lines of known models, for the tests of what is solved with them."""

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression import normal_equations
from sysid_node.online.regression.information import BANDS, Information, nothing
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]
STRUCTURE = {
    "CL": ("0", "alpha", "q", "de"),
    "CD": ("0", "alpha", "de"),
    "Cm": ("0", "alpha", "q", "de"),
    "CY": ("beta", "p", "dr"),
    "Cn": ("beta", "p", "dr"),
    "Cl": ("p",),
}
INSTRUMENTED = ("alpha", "q", "beta", "p")
ROWS = 120  # 20 in each band


def layout(instrumented: tuple[str, ...] = ()) -> SignalLayout:
    return SignalLayout(("alpha", "q", "beta", "p", "de", "dr"), ("de", "dr"), instrumented)


def made(equations: NormalEquations, seed: int = 0, noise: float = 0.3) -> tuple[Array, dict[str, Array]]:
    """Lines (ROWS, W) of regressors, their instruments, and outputs of a known model with white noise."""
    rng = np.random.default_rng(seed)
    lines = rng.normal(size=(ROWS, equations.width))
    truth = {}
    for c, coefficient in enumerate(equations.structure.coefficients):
        unknowns = equations.structure.unknowns(c)
        truth[coefficient] = rng.normal(size=unknowns.size)
        lines[:, equations.outputs[c]] = lines[:, equations.columns[unknowns]] @ truth[
            coefficient
        ] + noise * rng.normal(size=ROWS)
    return lines, truth


def information(lines: Array, density: float) -> Information:
    """Information of lines that are independent, of variance ``density`` each for noise of unit density."""
    info = nothing(layout(("alpha", "q", "beta", "p")))
    parts = np.split(lines, BANDS)
    info.grams = np.stack([part.T @ part for part in parts])
    info.scores = density * info.grams
    info.traces = np.full(BANDS, density * ROWS / BANDS)
    info.trace_square = density**2 * ROWS
    return info


PLAIN = normal_equations.normal_equations(STRUCTURE, layout())
INSTRUMENTAL = normal_equations.normal_equations(STRUCTURE, layout(INSTRUMENTED))
