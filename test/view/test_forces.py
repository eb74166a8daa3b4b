"""Arrows of forces have a length that can be drawn. Truth: the definition."""

import numpy as np
import pytest

from sysid_node.view.forces import arrow_scale


@pytest.mark.parametrize("largest", [0.0, 1e300, np.inf, np.nan])
def test_what_cannot_be_scaled_is_drawn_as_it_is(largest: float) -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        assert arrow_scale(np.full((5, 3), largest), span=2.0) == 1.0


def test_an_arrow_is_as_long_as_the_span_allows() -> None:
    vectors = np.tile([3.0, 0.0, 4.0], (10, 1))
    assert arrow_scale(2.0 * vectors, span=2.0) == pytest.approx(0.5 * arrow_scale(vectors, span=2.0))
