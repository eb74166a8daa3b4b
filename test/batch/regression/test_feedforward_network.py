"""The network: a linear map is learnt exactly, a smooth one closely, and slopes are derivatives."""

import numpy as np

from sysid_node.batch.regression.feedforward_network import network_output, network_slope, train_network

RNG = np.random.default_rng(1)
STATE, COEFFICIENTS = RNG.normal(size=(300, 2)), RNG.normal(size=(300, 2))
INPUTS = np.column_stack([STATE, COEFFICIENTS])


def test_a_linear_map_is_learnt_exactly():
    M = RNG.normal(size=(4, 3))
    weights = train_network(INPUTS, INPUTS @ M)
    np.testing.assert_allclose(network_output(weights, STATE, COEFFICIENTS), INPUTS @ M, atol=1e-3)
    slopes = network_slope(weights, STATE, COEFFICIENTS)
    np.testing.assert_allclose(slopes, np.broadcast_to(M[2:].T, (300, 3, 2)), atol=5e-3)


def test_a_smooth_map_is_learnt_closely_and_its_slope_is_the_derivative():
    target = np.tanh(INPUTS[:, :1] + 0.5 * INPUTS[:, 2:3])
    weights = train_network(INPUTS, target)
    assert np.std(network_output(weights, STATE, COEFFICIENTS) - target) < 0.05 * target.std()
    step = np.array([1e-5, 0.0])
    difference = (
        network_output(weights, STATE, COEFFICIENTS + step) - network_output(weights, STATE, COEFFICIENTS - step)
    ) / 2e-5
    np.testing.assert_allclose(network_slope(weights, STATE, COEFFICIENTS)[:, :, 0], difference, atol=1e-6)
