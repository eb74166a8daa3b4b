"""A least-recently-used cache that threads share."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock
from typing import Generic, TypeVar

_Value = TypeVar("_Value")


class LruCache(Generic[_Value]):
    """The ``size`` values by key that were asked for last; older ones are dropped."""

    def __init__(self, size: int) -> None:
        self._size, self._kept, self._lock = size, OrderedDict[bytes, _Value](), Lock()

    def get(self, key: bytes) -> _Value | None:
        """The value of a key, or None."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
            return self._kept.get(key)

    def keep(self, key: bytes, value: _Value) -> _Value:
        """The value, which is kept under the key."""
        with self._lock:
            self._kept[key] = value
            self._kept.move_to_end(key)
            if len(self._kept) > self._size:
                self._kept.popitem(last=False)
        return value
