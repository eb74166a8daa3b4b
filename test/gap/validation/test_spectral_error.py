"""How far a gap shrinks, by errors before, within tolerances, after, and of noise alone; truth: by hand."""

import numpy as np

from sysid_node.gap.validation.spectral_error import shrinkage


def test_what_is_closed_is_a_share_of_what_could_be() -> None:
    errors = np.array([[0.5, 0.4, 0.2, 0.1], [0.5, 0.4, 0.6, 0.1], [0.1, 0.1, 0.1, 0.1]])
    np.testing.assert_allclose(shrinkage(errors), [75.0, -25.0, 0.0])


def test_all_is_never_more_than_all() -> None:
    """By rounding, 100 (before - floor) / (before - floor) is more than 100 for some."""
    random = np.random.default_rng(1)
    before = random.uniform(0.1, 3.0, 10000)
    floor = before * random.uniform(0.0, 0.9, 10000)
    np.testing.assert_array_equal(shrinkage(np.stack([before, before, floor, floor], axis=-1)), 100.0)
