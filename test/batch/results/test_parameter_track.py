"""Estimates over time: at any sample, and after the last."""

import numpy as np
import pytest

from sysid_node.batch.results.parameter_track import ParameterTrack


def test_estimates_at_a_sample_have_normal_intervals():
    values = np.array([[1.0, 2.0], [1.5, 2.5]])
    track = ParameterTrack(np.arange(2.0), ("Cm_q", "Cm_de"), values, np.array([[1.0, 1.0], [0.5, 0.2]]), np.eye(2))
    assert track.at(0)["Cm_de"].value == 2.0
    final = track.final["Cm_q"]
    assert (final.value, final.standard_error, final.status) == (1.5, 0.5, "ok")
    assert final.upper == pytest.approx(1.5 + 1.959964 * 0.5)
