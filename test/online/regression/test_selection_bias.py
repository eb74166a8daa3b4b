"""When a standard error may be called small."""

import numpy as np
from made_lines import INSTRUMENTAL, PLAIN, information, made
from numpy.typing import NDArray

from sysid_node.online.regression import least_squares, normal_equations
from sysid_node.online.regression.selection_bias import selection_bias_factors

Array = NDArray[np.float64]


def judged(equations: normal_equations.NormalEquations, lines: Array, prior: Array, tolerance: float) -> Array:
    info = information(lines, 1.0)
    gram = info.grams.sum(axis=0)
    solution = least_squares.solve(equations, gram)
    instrument_strength, spread = (
        least_squares.instrument_strength(equations, solution, info),
        least_squares.uncertainty(equations, solution, info),
    )
    return selection_bias_factors(
        equations, solution, spread, instrument_strength, gram, prior, equations.structure.belongs * tolerance**-2
    )


def test_least_squares_need_none() -> None:
    lines, _ = made(PLAIN, 1)
    np.testing.assert_array_equal(judged(PLAIN, lines, 0.0 * PLAIN.structure.belongs, 0.1), 1.0)


def test_a_residual_that_is_small_because_the_estimate_is_off_counts_as_what_it_would_be() -> None:
    """u of y = x + u pulls an estimate by chance: the file, which knows better, shows how large the residual is."""
    rng = np.random.default_rng(4)
    equations, c = INSTRUMENTAL, 5
    x, z, y = (
        equations.columns[equations.structure.unknowns(c)[0]],
        equations.instruments[equations.structure.unknowns(c)[0]],
        equations.outputs[c],
    )
    lines = rng.normal(size=(120, equations.width))
    u = rng.normal(size=120)
    lines[:, z] = rng.normal(size=120) + 0.4 * u  # instruments that know of the noise, as chance may have it
    lines[:, x] = lines[:, z] + u
    lines[:, y] = lines[:, x] + u
    truth = equations.structure.belongs * 0.0
    truth[equations.structure.unknowns(c)[0], c] = 1.0
    known, unknown = judged(equations, lines, truth, 0.01), judged(equations, lines, truth, 1e3)
    unknowns = equations.structure.unknowns(c)[0], c
    assert known[unknowns] > 1.1 * unknown[unknowns]
    assert (judged(equations, lines, truth, 0.1)[equations.structure.belongs > 0.0] >= 1.0).all()
