"""How much of a vane's noise some blocks have room for. Truth: readings with noise of a known variance, or without."""

import numpy as np
import pytest

from sysid_node.faults.hypotheses.vane_noise import VaneReadings, shares

NOISE, BLOCKS = 0.001, 20  # rad
MOTION = 0.03 * np.sin(0.3 * np.arange(BLOCKS))  # rad: half a hertz


def noisy(seed: int, motion: np.ndarray) -> VaneReadings:
    """Readings with noise, which is all that makes them differ from what the force says."""
    noise = NOISE * np.random.default_rng(seed).standard_normal(BLOCKS)
    return VaneReadings(motion + noise, noise, noise)


@pytest.mark.parametrize("motion", [MOTION, np.zeros(BLOCKS)])
def test_noise_that_is_there_has_room(motion: np.ndarray) -> None:
    found = np.array([noisy(seed, motion).share(NOISE**2) for seed in range(200)])
    assert found.mean() > 0.8
    assert np.quantile(found, 0.05) > 0.4


def test_a_tenth_of_the_files_noise_has_a_hundredth_of_its_variance() -> None:
    found = [noisy(seed, np.zeros(BLOCKS)).share((10.0 * NOISE) ** 2) for seed in range(200)]
    assert np.mean(found) == pytest.approx(0.01, rel=0.2)


def test_noise_that_the_force_does_not_show_has_no_room() -> None:
    """A jammed vane, one without noise, and noise that is motion of the air, which the force follows."""
    read, noise, _ = noisy(1, MOTION)
    none = np.zeros(BLOCKS)
    assert VaneReadings(np.full(BLOCKS, 0.02), MOTION, MOTION).share(NOISE**2) == 0.0
    assert VaneReadings(MOTION, MOTION, MOTION).share(NOISE**2) < 0.05
    assert VaneReadings(read, none, noise).share(NOISE**2) == 0.0
    assert VaneReadings(read, noise, none).share(NOISE**2) == 0.0


def test_each_vane_has_its_own_share() -> None:
    known = {"alpha": noisy(2, MOTION), "beta": VaneReadings(*np.zeros((3, BLOCKS)))}
    found = shares(known, {"alpha": NOISE**2, "beta": NOISE**2})
    assert found["alpha"] == known["alpha"].share(NOISE**2) > 0.5
    assert found["beta"] == 0.0
    assert known["alpha"].first(10).read.size == 10
