"""What a flight does not determine, named."""

import numpy as np

from sysid_node.batch.results.identifiability import (
    identifiability_remarks,
    identifiability_status,
    inseparable_pairs,
    unidentifiable_groups,
)

NAMES = ("a", "b", "c", "d", "e")


def information(*columns):
    X = np.column_stack(columns)
    return X.T @ X


def test_all_kinds_at_once():
    rng = np.random.default_rng(1)
    a, b, d = rng.normal(size=(3, 100))
    groups = unidentifiable_groups(information(a, b, 1e4 * a, d, np.zeros(100)), NAMES)
    assert set(groups) == {("a", "c"), ("e",)}
    assert [identifiability_status(name, groups) for name in NAMES] == [
        "collinear with c",
        "ok",
        "collinear with a",
        "ok",
        "not excited",
    ]


def test_three_of_one_effect_are_one_group():
    rng = np.random.default_rng(2)
    a, b, d = rng.normal(size=(3, 100))
    assert unidentifiable_groups(information(a, b, a + b, d, d), NAMES) in (
        (("a", "b", "c"), ("d", "e")),
        (("d", "e"), ("a", "b", "c")),
    )


def test_good_data_leave_nothing_undetermined():
    X = np.random.default_rng(3).normal(size=(100, 5)) * [1.0, 1e-6, 1e6, 1.0, 1.0]  # sizes do not matter
    assert unidentifiable_groups(X.T @ X, NAMES) == ()


def test_pairs_come_worst_first_with_their_sign():
    covariance = np.array([[1.0, 0.96, 0.0], [0.96, 1.0, -0.99], [0.0, -0.99, 1.0]])
    assert inseparable_pairs(covariance, NAMES[:3]) == [("b", "c", -0.99), ("a", "b", 0.96)]
    assert identifiability_remarks(covariance, NAMES[:3], (("c",),)) == [
        "nothing here shows c",
        "a and b are hard to tell apart here (correlation +0.960); their intervals allow for it",
    ]
