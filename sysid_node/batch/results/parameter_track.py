"""Estimates over time, as a filter that passes once along the flights leaves them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sysid_node.batch.results.estimate import ParameterEstimate, confidence_interval
from sysid_node.flight.record import Array


@dataclass(frozen=True)
class ParameterTrack:
    """Estimates after each sample of all manoeuvres, one manoeuvre after the other.

    ``time`` (N,) s of flight so far; ``values`` and ``errors`` (N, P), the latter 1 sigma, of the free parameters named
    ``names``, in their own units; ``covariance`` (P, P) after the last sample.
    """

    time: Array
    names: tuple[str, ...]
    values: Array
    errors: Array
    covariance: Array

    def at(self, index: int) -> dict[str, ParameterEstimate]:
        """The estimates after sample ``index``, with the filter's own errors and normal 95 % intervals."""
        return {
            name: _estimate(name, float(value), float(error))
            for name, value, error in zip(self.names, self.values[index], self.errors[index], strict=True)
        }

    @property
    def final(self) -> dict[str, ParameterEstimate]:
        """The estimates after the last sample."""
        return self.at(-1)


def _estimate(name: str, value: float, error: float) -> ParameterEstimate:
    lower, upper = confidence_interval(value, error, np.inf)
    return ParameterEstimate(name, value, error, lower, upper, True, "ok", error)
