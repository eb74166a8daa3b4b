"""The lateral model: linear, so that its steady response is known."""

import numpy as np

from sysid_node.batch.likelihood import rollout
from sysid_node.batch.models.lateral_rates import lateral_rates
from sysid_node.batch.models.manoeuvre import ManoeuvreData

START = {"L_p": -2.0, "L_r": 1.0, "L_da": -6.0, "N_p": -0.2, "N_r": -0.5, "N_beta": 3.0, "L_beta": -4.0, "bias_r": 0.01}


def test_the_steady_rates_solve_the_linear_equations():
    model = lateral_rates(START)
    time = np.arange(0.0, 40.0, 0.02)
    da, beta = 0.05, 0.02
    inputs = np.column_stack([np.full(time.size, da), np.zeros(time.size), np.full(time.size, beta)])
    data = ManoeuvreData(time, inputs, np.zeros((time.size, 5)), np.zeros(2))
    pdot, rdot, ay, p, r = rollout.outputs(model, data, model.start)[-1]
    A = np.array([[START["L_p"], START["L_r"]], [START["N_p"], START["N_r"]]])
    b = np.array([START["L_da"] * da + START["L_beta"] * beta, START["N_beta"] * beta])
    np.testing.assert_allclose([p, r - START["bias_r"]], np.linalg.solve(A, -b), rtol=1e-6)
    np.testing.assert_allclose([pdot, rdot, ay], 0.0, atol=1e-6)


def test_parameters_missing_from_the_start_begin_at_zero():
    model = lateral_rates(START)
    start = dict(zip(model.names, model.start, strict=True))
    assert start["N_dr"] == 0.0
    assert start["L_p"] == -2.0
    assert len(start) == 22
