"""Measured and modelled outputs, and how well they agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.flight.record import Array


@dataclass(frozen=True)
class ModelResponse:
    """Measured and modelled outputs (N, ny) of one manoeuvre, on its ``time`` (N,) s; NaN = not measured."""

    name: str
    time: Array
    names: tuple[str, ...]
    measured: Array
    modelled: Array

    @property
    def residuals(self) -> Array:
        """Measured minus modelled (N, ny)."""
        return self.measured - self.modelled

    def column(self, name: str) -> tuple[Array, Array]:
        """One output as measured and as modelled, (N,) each."""
        index = self.names.index(name)
        return self.measured[:, index], self.modelled[:, index]


@dataclass(frozen=True)
class GoodnessOfFit:
    """Coefficient of determination R^2 of one output, its residual's root mean square in its unit, and the samples."""

    r_squared: float
    residual_std: float
    samples: int


def goodness_of_fit(responses: Sequence[ModelResponse]) -> dict[str, GoodnessOfFit]:
    """The goodness of fit of each output, over all responses together."""
    names = dict.fromkeys(name for response in responses for name in response.names)
    return {name: _goodness_of_fit([a.column(name) for a in responses if name in a.names]) for name in names}


def _goodness_of_fit(pairs: Sequence[tuple[Array, Array]]) -> GoodnessOfFit:
    measured, modelled = (np.concatenate(part) for part in zip(*pairs, strict=True))
    kept = np.isfinite(measured - modelled)
    samples = int(kept.sum())
    if not samples:
        return GoodnessOfFit(float("nan"), float("nan"), 0)
    squares = float(np.sum((measured - modelled)[kept] ** 2))
    spread = float(np.sum((measured[kept] - measured[kept].mean()) ** 2))
    explained = 1.0 - squares / spread if spread > 0.0 else float("nan")
    return GoodnessOfFit(explained, float(np.sqrt(squares / samples)), samples)
