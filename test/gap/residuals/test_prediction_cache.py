"""A cache belongs to one residual model and goes with it."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.residuals.prediction_cache import cache_of


def test_a_model_that_differs_in_anything_has_a_cache_of_its_own(plain_model) -> None:
    """A prediction of the model with the longer memory must not be returned for the other."""
    copy = replace(plain_model)
    assert cache_of(copy) is not cache_of(plain_model)
    assert cache_of(copy) is cache_of(copy)


def test_a_cache_is_dropped_with_its_model(plain_model) -> None:
    copy = replace(plain_model)
    cache = weakref.ref(cache_of(copy))
    assert cache() is not None
    del copy
    gc.collect()
    assert cache() is None


def test_constants_are_computed_once_and_results_by_key(plain_model) -> None:
    cache = cache_of(replace(plain_model))
    assert cache.constant("a", lambda: 1) == 1
    assert cache.constant("a", lambda: pytest.fail("computed again")) == 1
    assert cache.result(b"x", lambda: 2) == 2
    assert cache.result(b"x", lambda: pytest.fail("computed again")) == 2
    assert cache.result(b"y", lambda: 3) == 3


def test_cached_predictions_are_those_of_a_fresh_model(plain_model) -> None:
    simulator = plain_model.simulator
    points = [simulator.vector({"cg_shift": {"x": x}}) for x in (0.01, 0.02, 0.03)]
    used = replace(plain_model)
    for point in points:
        used.residual(point)
    for point in points:
        np.testing.assert_array_equal(used.residual(point), replace(plain_model).residual(point))
