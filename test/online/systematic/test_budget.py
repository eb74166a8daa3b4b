"""The error budget against variances that are known exactly."""

import pickle

import numpy as np
import pytest

from sysid_node.online.systematic.budget import Budget


def test_independent_sources_share_the_variance():
    """With independent sources the shares are those of GUM, sec. 5.1.2: (sensitivity times uncertainty) squared."""
    covariance = np.diag([0.1, 0.2, 0.0]) ** 2
    budget = Budget(("Cl_p",), ("mass", "actuator_lag.aileron", "inertia.Ixx"), np.array([[2.0], [3.0], [5.0]]),
                    covariance, np.array([0.05]))  # fmt: skip
    total = 0.05 + 0.04 + 0.36
    expected = {"actuator_lag.aileron": 0.36 / total, "statistical": 0.05 / total, "mass": 0.04 / total}
    assert list(budget["Cl_p"]) == list(expected)
    assert budget["Cl_p"] == pytest.approx(expected)


def test_a_share_is_what_knowing_the_source_would_save():
    """The conditional variance of a normal distribution, for sources that are correlated; one has two numbers."""
    generator = np.random.default_rng(1)
    root = generator.normal(size=(3, 3))
    covariance, gradient = root @ root.T, generator.normal(size=3)
    budget = Budget(("Cn_r",), ("mass", "servo", "servo"), gradient[:, None], covariance, np.array([0.5]))
    total = 0.5 + gradient @ covariance @ gradient
    for key, known, left in (("mass", [0], [1, 2]), ("servo", [1, 2], [0])):
        gained = covariance[np.ix_(left, known)] @ np.linalg.inv(covariance[np.ix_(known, known)])
        within = covariance[np.ix_(left, left)] - gained @ covariance[np.ix_(known, left)]
        remaining = 0.5 + gradient[left] @ within @ gradient[left]
        assert budget["Cn_r"][key] == pytest.approx(1.0 - remaining / total)


def test_is_a_plain_dictionary_once_it_was_pickled():
    budget = Budget(("Cm_q",), ("mass",), np.array([[1.0]]), np.array([[1.0]]), np.array([1.0]))
    copied = pickle.loads(pickle.dumps(budget))
    assert type(copied) is dict
    assert copied == {"Cm_q": {"statistical": 0.5, "mass": 0.5}}
