"""What an effect must take away. Truth: remainders made by hand."""

from types import SimpleNamespace

import numpy as np

from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.gap.selection.acceptance import _shifts

WINDOWS, LINES = 6, 5
V = CHANNELS.index("V")


def trial(mean: float, noise: float, random: np.random.Generator) -> SimpleNamespace:
    """Of a flight whose motion has a power of one at each line; ``mean`` of the remainder of the airspeed."""
    left = noise * (random.standard_normal((WINDOWS, LINES, 12)) + 1j * random.standard_normal((WINDOWS, LINES, 12)))
    left[:, 0] = 0.0
    left[:, 0, V] = mean
    model = SimpleNamespace(measured=np.ones((WINDOWS, LINES, 12), complex))
    flight = SimpleNamespace(residual=left, model=model)
    return SimpleNamespace(evidence=SimpleNamespace(flights=(flight,)))


def test_what_is_off_on_average_counts_whatever_weather_is_left(random: np.random.Generator) -> None:
    shifted = _shifts(trial(0.5, 3.0, random), trial(0.1, 3.0, random))
    assert np.flatnonzero(shifted).tolist() == [V]


def test_an_offset_that_nobody_would_look_for_does_not(random: np.random.Generator) -> None:
    assert not _shifts(trial(0.05, 3.0, random), trial(0.0, 3.0, random)).any()


def test_nor_what_comes_and_goes(random: np.random.Generator) -> None:
    before = trial(0.0, 0.0, random)
    before.evidence.flights[0].residual[:, 0, V] = 2.0 * (-1.0) ** np.arange(WINDOWS)
    assert not _shifts(before, trial(0.0, 0.0, random)).any()
