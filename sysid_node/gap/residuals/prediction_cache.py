"""The cache of a residual model: what was computed of a flight lately, looked up by the model's identity.

Fits ask for the same parameters again and again, from several threads. A residual model is immutable; its cache lies
here and is dropped together with the model.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from sysid_node.flight.record import Array
from sysid_node.gap.residuals.flight_path_reconstruction import Flow
from sysid_node.gap.residuals.lru_cache import LruCache
from sysid_node.gap.residuals.windowed_spectra import Complex

#: Predictions that are kept: fits ask for the same point again, and kinematics stay while forces are fitted.
_PREDICTIONS = 32

#: Slopes that are kept, and results of others; both are large.
_SLOPES, _RESULTS = 4, 8

_Result = TypeVar("_Result")


class PredictionCache:
    """What was computed of one flight: spectra by the bytes of the parameters that they depend on."""

    def __init__(self) -> None:
        self.forces: LruCache[Complex] = LruCache(_PREDICTIONS)  # (W, L, 6)
        self.readings: LruCache[Complex] = LruCache(_PREDICTIONS)  # (W, L, 6)
        self.flows: LruCache[Flow | None] = LruCache(_PREDICTIONS)
        self.slopes: LruCache[Complex] = LruCache(_SLOPES)  # (W, L, 12, K)
        self.short_flights: LruCache[Array] = LruCache(_PREDICTIONS)  # (S, R) mean squares by short flight and reading
        self._results: LruCache[Any] = LruCache(_RESULTS)
        self._constants: dict[str, Any] = {}

    def constant(self, name: str, work: Callable[[], _Result]) -> _Result:
        """What ``work`` returns, which depends on the flight alone: computed once by name."""
        if name not in self._constants:
            self._constants[name] = work()
        result: _Result = self._constants[name]
        return result

    def result(self, key: bytes, work: Callable[[], _Result]) -> _Result:
        """What ``work`` returns, which depends on the flight and the key; computed again when long not asked for."""
        known: _Result | None = self._results.get(key)
        return self._results.keep(key, work()) if known is None else known


_CACHES: WeakKeyDictionary[object, PredictionCache] = WeakKeyDictionary()
_LOCK = Lock()


def cache_of(model: object) -> PredictionCache:
    """The cache of a residual model, which is another's even where all of its data are the same."""
    with _LOCK:
        cache = _CACHES.get(model)
        if cache is None:
            cache = _CACHES[model] = PredictionCache()
        return cache
