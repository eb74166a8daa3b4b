"""What was worked out lately is given again, and only so much of it."""

from sysid_node.gap.residuals.lru_cache import LruCache


def test_the_latest_are_kept_and_the_oldest_forgotten() -> None:
    recent = LruCache[int](2)
    for value in range(3):
        assert recent.keep(bytes([value]), value) == value
    assert [recent.get(bytes([value])) for value in range(3)] == [None, 1, 2]


def test_what_was_asked_for_is_kept_longer() -> None:
    recent = LruCache[int](2)
    for value in range(2):
        recent.keep(bytes([value]), value)
    assert recent.get(bytes([0])) == 0
    recent.keep(bytes([2]), 2)
    assert [recent.get(bytes([value])) for value in range(3)] == [0, None, 2]
