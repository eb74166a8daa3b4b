"""The share by which sizes are off beyond chance; truth: the share that they were drawn with."""

import numpy as np
import pytest

from bench.gap.size_errors import held, learned


def test_the_share_is_found_again() -> None:
    random = np.random.default_rng(2)
    true, error = random.uniform(0.5, 2.0, 4000), random.uniform(0.005, 0.05, 4000)
    found = true * (1.0 + 0.04 * random.standard_normal(4000)) + error * random.standard_normal(4000)
    assert learned(true, found, error) == pytest.approx(0.04, abs=0.004)
    assert held(true, found, error, 0.04, 1.96) == pytest.approx(0.95, abs=0.01)
    assert held(true, found, error, 0.0, 1.96) < 0.8


def test_sizes_that_are_plainly_wrong_do_not_rule_it() -> None:
    random = np.random.default_rng(3)
    true, error = np.ones(1000), np.full(1000, 0.01)
    found = true + error * random.standard_normal(1000)
    found[:30] = 3.0
    assert learned(true, found, error) < 0.01
