"""Constrained least squares: the constraints without motion, the data with it."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, KINKS, TRUTH, clean, largest_error

from sysid_node.batch.methods.constrained_least_squares import constrained_least_squares


def test_without_motion_the_constraints_hold_everything():
    record = clean()
    still = {name: np.full(len(record), float(values[0])) for name, values in record.columns.items()}
    fit = constrained_least_squares(KESTREL, [dataclasses.replace(record, columns=still)])
    for name in ("Cl_p", "Cl_da", "Cn_dr", "CY_r"):
        assert fit.values[name] == pytest.approx(TRUTH[name], rel=1e-6), name


def test_with_motion_the_data_win():
    wrong = {
        name: dataclasses.replace(d, value=1.3 * d.value, tolerance=abs(0.3 * d.value))
        for name, d in KESTREL.derivatives.items()
    }
    fit = constrained_least_squares(dataclasses.replace(KESTREL, derivatives=wrong), [clean(), clean(turn=-1)])
    assert largest_error(fit) < KINKS
