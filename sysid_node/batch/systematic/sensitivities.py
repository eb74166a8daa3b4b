"""How far the estimates of each method move with a small change of the flights, to first order.

A regression of y on X gives theta = A y. A change of the flights moves it by A z with z = d(y - X theta), because what
the change of A does to the residuals, which are noise, is of second order. A search for the maximum likelihood ends
where J' r = 0, with the residuals r in units of the noise and their Jacobian J; it moves by -(J'J)^-1 J' dr.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.filtering import lowpass
from sysid_node.batch.regression.measured_coefficients import MeasuredCoefficients, measured_coefficients
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient
from sysid_node.batch.regression.sequential import sample_weights
from sysid_node.flight.record import Array, FlightRecord

#: From other records of the same flights to the change of the estimates (P,).
Response = Callable[[Sequence[FlightRecord]], Array]


class RegressionResponse:
    """The change of a regression's estimates with its flights.

    ``low_pass`` (Hz): what both sides of the equations are filtered by; 0 = nothing. ``forgetting``: the share of its
    weight that a sample keeps in a second.
    """

    def __init__(
        self,
        aircraft: Aircraft,
        records: Sequence[FlightRecord],
        values: Mapping[str, float],
        low_pass: float = 0.0,
        forgetting: float = 1.0,
    ) -> None:
        self._aircraft, self._low_pass, self._forgetting = aircraft, low_pass, forgetting
        self._names = tuple(values)
        flights = self._flights = [measured_coefficients(aircraft, record) for record in records]
        self._structure = regressors_by_coefficient(aircraft, flights)
        self._theta = {
            c: np.array([values[f"{c}_{regressor}"] for regressor in regressors])
            for c, regressors in self._structure.items()
        }
        self._residuals = {c: self._residual(c, flights) for c in self._structure}
        self._filtered = {
            c: self._weighted([regressor_matrix(flight, regressors) for flight in flights])
            for c, regressors in self._structure.items()
        }

    def __call__(self, records: Sequence[FlightRecord], aircraft: Aircraft | None = None) -> Array:
        """(P,) change of the estimates, those of other parameters than the regressions' zero.

        ``aircraft``: another file, by which the coefficients of the ``records`` are measured.
        """
        flights = [measured_coefficients(aircraft or self._aircraft, record) for record in records]
        change = np.zeros(len(self._names))
        for c, regressors in self._structure.items():
            rows = zip(self._residual(c, flights), self._residuals[c], flights, self._flights, strict=True)
            z = [_at(base.time, other.time, moved) - own for moved, own, other, base in rows]
            X, y = self._filtered[c], self._weighted([column[:, None] for column in z])
            found = np.linalg.lstsq(X, y[:, 0], rcond=None)[0]
            change[[self._names.index(f"{c}_{regressor}") for regressor in regressors]] = found
        return change

    def _residual(self, coefficient: str, flights: Sequence[MeasuredCoefficients]) -> list[Array]:
        """y - X theta (N,) of each flight."""
        regressors, theta = self._structure[coefficient], self._theta[coefficient]
        return [f.coefficients[coefficient] - regressor_matrix(f, regressors) @ theta for f in flights]

    def _weighted(self, blocks: Sequence[Array]) -> Array:
        """The filtered rows of all flights, one below the other, each times the root of its weight."""
        times = [flight.time for flight in self._flights]
        rows = np.concatenate([lowpass(t, X, self._low_pass) for t, X in zip(times, blocks, strict=True)])
        return np.asarray(rows * np.sqrt(np.concatenate(sample_weights(times, self._forgetting)))[:, None])


def _at(time: Array, other: Array, values: Array) -> Array:
    """The values at these times, where another correction left out other samples."""
    return values if np.array_equal(time, other) else np.interp(time, other, values)


class LikelihoodResponse:
    """The change of the first ``count`` unknowns of a search for the maximum likelihood with its flights.

    ``residuals`` gives, from records, all residuals (N,) in units of the noise at the unknowns that the search ended
    with; ``jacobian`` (N, n) is their Jacobian with respect to these, for the ``records`` of the fit.
    """

    def __init__(
        self,
        residuals: Callable[[Sequence[FlightRecord]], Array],
        records: Sequence[FlightRecord],
        jacobian: Array,
        count: int,
    ) -> None:
        scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
        self._jacobian = jacobian / scale
        inverse = np.linalg.pinv(self._jacobian.T @ self._jacobian, rcond=1e-12, hermitian=True)
        self._gain = (inverse / scale[:, None])[:count]
        self._residuals, self._base = residuals, residuals(records)

    def __call__(self, records: Sequence[FlightRecord]) -> Array:
        """(P,) change of the parameters."""
        return np.asarray(-self._gain @ (self._jacobian.T @ (self._residuals(records) - self._base)))
