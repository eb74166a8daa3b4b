"""What was worked out lately, kept for whoever asks for the same again: threads share it."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock
from typing import Generic, TypeVar

_Value = TypeVar("_Value")


class Recent(Generic[_Value]):
    """The latest ``size`` values by key; older ones are forgotten."""

    def __init__(self, size: int) -> None:
        self._size, self._kept, self._lock = size, OrderedDict[bytes, _Value](), Lock()

    def get(self, key: bytes) -> _Value | None:
        """What was kept under a key, or None."""
        with self._lock:
            return self._kept.get(key)

    def keep(self, key: bytes, value: _Value) -> _Value:
        """Keeps a value and gives it back."""
        with self._lock:
            self._kept[key] = value
            if len(self._kept) > self._size:
                self._kept.popitem(last=False)
        return value
