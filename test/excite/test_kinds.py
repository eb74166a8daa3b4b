"""Every kind of manoeuvre: its peak, its length, and controls that it keeps apart."""

import numpy as np
import pytest

from sysid_node.excite.kinds import KINDS

RATE = 100.0


@pytest.mark.parametrize("name", KINDS)
def test_the_peak_is_one_and_nothing_is_outside_the_length(name):
    kind = KINDS[name]
    values = {key: known.default for key, known in kind.keys.items()}
    length = kind.length(values)
    time = np.arange(-100, round(RATE * length) + 200) / RATE
    inputs = kind.draw(time, values, 2)
    assert inputs.shape == (2, time.size)
    assert np.abs(inputs).max(axis=1) == pytest.approx(1.0, abs=0.02)
    outside = (time < -1e-6) | (time > length + 1e-6)
    assert not inputs[:, outside].any()


@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if kind.orthogonal])
def test_orthogonal_kinds_give_uncorrelated_inputs(name):
    kind = KINDS[name]
    values = {key: known.default for key, known in kind.keys.items()}
    time = np.arange(round(RATE * kind.length(values))) / RATE
    assert abs(np.corrcoef(kind.draw(time, values, 2))[0, 1]) < 0.2
