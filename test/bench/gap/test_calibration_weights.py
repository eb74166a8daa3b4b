"""Weights learned from causes of known truth; truth: weights that the causes were drawn by."""

import numpy as np
import pytest

from bench.gap.calibration_weights import learned


def test_weights_are_found_again() -> None:
    random, true = np.random.default_rng(1), np.array([-4.0, 1.2, -5.0])
    X = np.column_stack([np.ones(4000), random.uniform(0.0, 8.0, 4000), random.uniform(0.0, 1.0, 4000)])
    right = (random.random(4000) < 1.0 / (1.0 + np.exp(-X @ true))).astype(float)
    assert learned(X, right) == pytest.approx(true, rel=0.15)


def test_what_is_parted_without_exception_is_not_certain() -> None:
    """The likeliest weights would have no end."""
    X = np.column_stack([np.ones(8), np.arange(8.0), np.tile([0.0, 0.1], 4)])
    right = (np.arange(8) > 3).astype(float)
    p = 1.0 / (1.0 + np.exp(-X @ learned(X, right)))
    assert (p[4:] > 0.5).all()
    assert (p[:4] < 0.5).all()
    assert p.max() < 0.995
