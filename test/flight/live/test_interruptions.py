"""Samples that come in short parts. Truth: the parts that were made."""

import math

import numpy as np
import pytest

from sysid_node.flight.live.interruptions import Interruptions

MAX_GAP = 0.2


def came(parts: list[float], pause: float = 0.25, interruptions: Interruptions | None = None) -> tuple:
    """Parts of so many seconds with pauses between them, and the time of the last sample."""
    interruptions, time, before = interruptions or Interruptions(), 0.0, None
    for seconds in parts:
        interruptions.add(before, time)
        before = time + seconds
        time = before + pause
    return interruptions, before


def test_short_parts_are_told_with_their_length_and_what_to_do() -> None:
    interruptions, last = came([0.75] * 30)
    text = interruptions.fault(last, MAX_GAP)
    assert text.startswith("29 interruptions of up to 0.25 s in 30 s, and no longer part without one than 0.8 s")
    assert text.endswith("set max_gap (0.2 s) to more than 0.25 s")
    assert "20 interruptions of up to 0.25 s" in interruptions.recent_fault(last, MAX_GAP)


def test_samples_at_once_are_taken_as_one_at_a_time() -> None:
    """The samples of the same parts, in pieces, of which one begins with an interruption and one is empty."""
    begins = np.arange(30) * 1.0
    times = (begins[:, None] + np.linspace(0.0, 0.75, 16)).ravel()
    together = Interruptions()
    for piece in np.split(times, [160, 160, 200]):
        before = times[np.searchsorted(times, piece[0]) - 1] if piece.size and piece[0] > 0.0 else math.nan
        together.add_samples(float(before), piece, MAX_GAP)
    alone, last = came([0.75] * 30)
    assert together.fault(last, MAX_GAP) == alone.fault(last, MAX_GAP) != ""


def test_over_long_interruptions_nothing_should_be_interpolated() -> None:
    interruptions, last = came([2.0] * 10, pause=1.0)
    assert "interruptions of up to 1.00 s" in interruptions.fault(last, MAX_GAP)
    assert "max_gap" not in interruptions.fault(last, MAX_GAP)


@pytest.mark.parametrize("parts", [[60.0], [5.0] * 12, [0.5, 0.5, 60.0], [1.0, 1.0]])
def test_parts_that_are_long_or_few_are_none_of_the_users_trouble(parts: list[float]) -> None:
    interruptions, last = came(parts)
    assert interruptions.fault(last, MAX_GAP) == ""
    assert interruptions.recent_fault(last, MAX_GAP) == ""


def test_nothing_is_told_of_the_first_seconds() -> None:
    interruptions, last = came([0.75] * 8)
    assert interruptions.recent_fault(last, MAX_GAP) == ""


def test_of_the_present_it_is_told_only_as_long_as_it_lasts() -> None:
    interruptions, last = came([0.75] * 30)
    assert interruptions.recent_fault(last, MAX_GAP)
    assert interruptions.recent_fault(last + 4.0, MAX_GAP) == ""
    assert interruptions.fault(last + 4.0, MAX_GAP) == ""


def test_before_the_first_sample_there_is_nothing_to_tell() -> None:
    assert Interruptions().fault(math.nan, MAX_GAP) == ""
    assert Interruptions().recent_fault(0.0, MAX_GAP) == ""


def test_what_is_remembered_does_not_grow_with_the_flight() -> None:
    """Truth: of a minute and of an hour of an IMU at 4 Hz as many parts are remembered."""
    sizes = [len(came([0.0] * (4 * seconds))[0].parts) for seconds in (60, 3600)]
    assert sizes[0] == sizes[1]
