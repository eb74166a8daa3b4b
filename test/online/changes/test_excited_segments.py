"""What well-excited flight has said: which segments are remembered and recalled. Truth: segments made up."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from sysid_node.online.changes.excited_segments import (
    KEPT,
    ExcitedSegments,
    estimates_of,
    no_excited_segments,
    remember,
)
from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression import normal_equations
from sysid_node.online.regression.information import BANDS, Information, nothing
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]
LAYOUT = SignalLayout(("alpha", "beta", "de", "da", "dr"), ("de", "da", "dr"), ())
PLAN: NormalEquations = normal_equations.normal_equations(
    {"Cm": ("0", "alpha", "de"), "Cn": ("0", "beta", "da", "dr")}, LAYOUT
)
ROWS = 20  # lines of each band


def segment(seed: int = 0, theta: float = 1.0, **moved: float) -> Information:
    """A segment whose controls ``moved`` by so much (else 1), every derivative being ``theta``; little noise."""
    rng = np.random.default_rng(seed)
    lines = rng.normal(size=(BANDS, ROWS, PLAN.width))
    for name, size in moved.items():
        lines[..., LAYOUT.column(name)] *= size
    for c in range(PLAN.outputs.size):
        x = lines[..., PLAN.columns[PLAN.structure.unknowns(c)]]
        lines[..., PLAN.outputs[c]] = theta * x.sum(axis=-1) + 1e-3 * rng.normal(size=x.shape[:-1])
    said = nothing(LAYOUT)
    said.grams = lines.swapaxes(-1, -2) @ lines
    said.scores, said.traces, said.trace_square = said.grams, np.full(BANDS, float(ROWS)), float(BANDS * ROWS)
    return said


@pytest.fixture
def known() -> list[ExcitedSegments]:
    return no_excited_segments(PLAN, LAYOUT)


def ends(excited: ExcitedSegments) -> list[float]:
    return [s.end for s in excited.segments]


def test_each_block_has_its_own_controls(known: list[ExcitedSegments]) -> None:
    assert [e.controls.tolist() for e in known] == [
        [LAYOUT.column("de")],
        [LAYOUT.column("da"), LAYOUT.column("dr")],
    ]


def test_quiet_segments_are_no_experience(known: list[ExcitedSegments]) -> None:
    """One of a block's controls has to have moved about as much as it ever did."""
    remember(known, segment(), 25.0)
    remember(known, segment(de=0.1), 50.0)
    remember(known, segment(da=0.1, dr=0.1), 75.0)
    remember(known, segment(da=0.1), 100.0)
    assert ends(known[0]) == [25.0, 75.0, 100.0]
    assert ends(known[1]) == [25.0, 50.0, 100.0]


def test_what_was_quiet_beside_later_manoeuvres_is_not_recalled(known: list[ExcitedSegments]) -> None:
    remember(known, segment(seed=1, theta=2.0, de=0.01), 25.0)
    remember(known, segment(seed=2, theta=1.0), 50.0)
    found = estimates_of(known[0], PLAN, -math.inf, 60.0)
    assert found is not None
    assert found.time == 50.0
    np.testing.assert_allclose(found.solution.theta[PLAN.structure.unknowns(0), 0], 1.0, rtol=1e-2)


def test_only_segments_of_the_time_are_recalled(known: list[ExcitedSegments]) -> None:
    for end, theta in ((25.0, 1.0), (50.0, 2.0), (75.0, 3.0)):
        remember(known, segment(seed=int(end), theta=theta), end)
    found = estimates_of(known[1], PLAN, 30.0, 60.0)
    assert found is not None
    np.testing.assert_allclose(found.solution.theta[PLAN.structure.unknowns(1), 1], 2.0, rtol=1e-2)
    assert estimates_of(known[1], PLAN, -math.inf, 20.0) is None


def test_more_than_ever_is_beyond_experience(known: list[ExcitedSegments]) -> None:
    remember(known, segment(), 25.0)
    peak = known[0].peaks()
    assert not known[0].exceeds_all(2.0 * peak)
    assert known[0].exceeds_all(5.0 * peak)


def test_memory_is_bounded(known: list[ExcitedSegments]) -> None:
    said = segment()
    for i in range(3 * KEPT):
        remember(known, said, 25.0 * i)
    assert len(known[0].segments) == KEPT
