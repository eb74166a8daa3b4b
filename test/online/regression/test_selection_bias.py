"""When a standard error may be called small."""

import numpy as np
from made_lines import INSTRUMENTAL, PLAIN, information, made
from numpy.typing import NDArray

from sysid_node.online.regression import least_squares, normal_equations
from sysid_node.online.regression.selection_bias import selection_bias_factors

Array = NDArray[np.float64]


def judged(plan: normal_equations.NormalEquations, lines: Array, believed: Array, tolerance: float) -> Array:
    info = information(lines, 1.0)
    gram = info.grams.sum(axis=0)
    solution = least_squares.solve(plan, gram)
    hold, spread = (
        least_squares.instrument_strength(plan, solution, info),
        least_squares.uncertainty(plan, solution, info),
    )
    return selection_bias_factors(plan, solution, spread, hold, gram, believed, plan.mine * tolerance**-2)


def test_least_squares_need_none() -> None:
    lines, _ = made(PLAIN, 1)
    np.testing.assert_array_equal(judged(PLAIN, lines, 0.0 * PLAIN.mine, 0.1), 1.0)


def test_a_residual_that_is_small_because_the_estimate_is_off_counts_as_what_it_would_be() -> None:
    """u of y = x + u pulls an estimate by chance: the file, which knows better, shows how large the residual is."""
    rng = np.random.default_rng(4)
    plan, c = INSTRUMENTAL, 5
    x, z, y = plan.columns[plan.unknowns(c)[0]], plan.instruments[plan.unknowns(c)[0]], plan.outputs[c]
    lines = rng.normal(size=(120, plan.width))
    u = rng.normal(size=120)
    lines[:, z] = rng.normal(size=120) + 0.4 * u  # instruments that know of the noise, as chance may have it
    lines[:, x] = lines[:, z] + u
    lines[:, y] = lines[:, x] + u
    truth = plan.mine * 0.0
    truth[plan.unknowns(c)[0], c] = 1.0
    known, unknown = judged(plan, lines, truth, 0.01), judged(plan, lines, truth, 1e3)
    mine = plan.unknowns(c)[0], c
    assert known[mine] > 1.1 * unknown[mine]
    assert (judged(plan, lines, truth, 0.1)[plan.mine > 0.0] >= 1.0).all()
