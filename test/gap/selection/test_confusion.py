"""How similar the responses of effects are; truth: residuals made by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid_node.gap.selection.confusion import confusion_of


def fitted(label: str, residual: list[float]) -> Any:
    """A set that leaves a residual (of one window, lines and twelve channels) of one flight, weighted by one."""
    amplitudes = np.zeros((1, len(residual), 12), complex)
    amplitudes[0, :, 0] = residual
    flight = SimpleNamespace(residual=amplitudes, weights=np.ones((2 * len(residual), 12)))
    return SimpleNamespace(
        fit=SimpleNamespace(flights=(flight,)), added=SimpleNamespace(label=label) if label else None
    )


def test_the_cosine_is_that_of_what_effects_remove() -> None:
    """Of [3, 4, 0] nuisances leave, they remove [3, 4, 0], [3, 0, 0], [0, 4, 0] and twice the first."""
    base = fitted("", [3.0, 4.0, 0.0])
    sets = [fitted("a", [0.0, 0.0, 0.0]), fitted("b", [0.0, 4.0, 0.0]), fitted("c", [3.0, 0.0, 0.0]),
            fitted("d", [-3.0, -4.0, 0.0])]  # fmt: skip
    found = confusion_of(base, sets)
    assert found.labels == ("a", "b", "c", "d")
    expected = [[1.0, 0.6, 0.8, 1.0], [0.6, 1.0, 0.0, 0.6], [0.8, 0.0, 1.0, 0.8], [1.0, 0.6, 0.8, 1.0]]
    np.testing.assert_allclose(found.cosines, expected, atol=1e-12)


def test_an_effect_that_removes_nothing_resembles_nothing() -> None:
    found = confusion_of(fitted("", [1.0, 1.0]), [fitted("a", [1.0, 1.0]), fitted("b", [0.0, 1.0])])
    assert found.cosines[0, 1] == pytest.approx(0.0)
