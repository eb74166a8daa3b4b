"""Variable projection: the candidates' parameters by nonlinear least squares, nuisances eliminated by linear algebra.

At given weights the nuisance parameters enter linearly about where they stand, with their priors as further rows of
the problem. What is left of the residual and of the slopes after they are projected out is a small nonlinear problem in
the candidates' parameters alone (Golub & Pereyra (1973), SIAM J. Numer. Anal. 10(2); the approximate Jacobian is
Kaufman's (1975), BIT 15).
"""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.bounded_least_squares import bounded_least_squares
from sysid_node.gap.estimation.candidate_fit import CandidateFit, FlightFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.spectral_weights import amplitudes, real_rows, spectral_deviance
from sysid_node.gap.residuals.parameter_priors import prior
from sysid_node.gap.residuals.windowed_spectra import Complex

#: Weighted residual beyond which a prediction counts as divergent.
_DIVERGENT = 1e100

#: Times that nuisance parameters are put at their limits before what is left beyond is cut off.
_BINDINGS = 6

#: Share of its limit within which a nuisance parameter stands at it.
_AT_LIMIT = 1e-6


class VariableProjection:
    """The least-squares problem in the candidates' parameters of a fit, with the nuisance parameters at their best.

    Nuisance parameters that would go beyond their limits are put there and stay: an active set, found anew for each
    linearisation. They are counted in units of their prior standard deviations. Their priors are then a unit matrix, so
    that the normal equations are well conditioned even where the flight says little about some of them.

    ``near`` is the problem of the same fit at a point nearby, whose slopes are taken instead of new ones.
    """

    def __init__(self, fit: CandidateFit, near: VariableProjection | None = None) -> None:
        self.fit, self._held = fit, near is not None
        self._own_slopes: list[Complex] = []  # (W, L, 12, K) by flight where the fit stands, once needed
        self._known: list[Complex] = []  # (W, L, 12, k) by flight, of the first k values, where others are added
        self._value_slopes: list[Complex] = near._value_slopes if near else []  # (W, L, 12, K) by flight, the last ones
        self.slopes: list[Complex] = (  # (W, L, 12, K) by flight, by the nuisance parameters
            near.slopes if near else [f.model.slopes(f.point, list(f.nuisances.indices)) for f in fit.flights]
        )
        blocks = []
        for number, (flight, by_nuisance) in enumerate(zip(fit.flights, self.slopes, strict=True)):
            columns = real_rows(by_nuisance, flight.weights).reshape(-1, len(flight.nuisances.indices))
            blocks.append(flight.nuisances.among_all(columns, number, len(fit.flights)))
        self.now, self.spread, self.limit = fit.stacked
        self.matrix = np.vstack([*(block * self.spread for block in blocks), np.eye(self.now.size)])
        self.gram = self.matrix.T @ self.matrix
        self.indices = list(fit.indices)
        self._set_priors()
        self._kept = (b"", np.empty((0, 0)))
        self.replaced = np.zeros(self.now.size, bool)  # nuisances that a candidate that was added is or replaces
        self._set_free(np.ones(self.now.size, bool), np.zeros(self.now.size))
        self._bind(fit.values)

    def _set_priors(self) -> None:
        """Sets the priors of the values and of the nuisance parameters, moved by the pull of the regressors' noise.

        A linear term in the logarithm of a Gaussian density moves its centre.
        """
        self.file_centre, self.sigma = prior(self.fit.simulator, self.indices)
        pull = self.fit.noise_gradient_on(self.indices)
        self.centre = self.file_centre + self.sigma**2 * pull[: len(self.indices)]
        self.nuisance_centre = self.spread**2 * pull[len(self.indices) :]

    def _set_free(self, free: NDArray[np.bool_], shift: Array) -> None:
        """Sets which nuisance parameters may move, and how far the others stand from where the residual is taken."""
        self.free, self.shift = free, shift
        self.shifted_rows = self.matrix @ (shift / self.spread)
        self.factor = cho_factor(self.gram[np.ix_(free, free)], check_finite=False)

    def _best(self, rows: Array) -> Array:
        """Nuisance parameters (K, ...), in sigmas, that minimise rows (R, ...); those that may not move are zero."""
        best = np.zeros((self.now.size, *rows.shape[1:]))
        best[self.free] = cho_solve(self.factor, (self.matrix.T @ rows)[self.free], check_finite=False)
        return best

    def _bind(self, values: Array) -> None:
        """Puts at their limits those that would go beyond, until none would."""
        for _ in range(_BINDINGS):
            nuisances = self.now + self._nuisance_step(values)
            beyond = self.free & (np.abs(nuisances) > self.limit)
            if not beyond.any():
                return
            shift = np.where(beyond, np.sign(nuisances) * self.limit - self.now, self.shift)
            self._set_free(self.free & ~beyond, shift)

    def _nuisance_step(self, values: Array) -> Array:
        """How far the nuisance parameters' best at these values lies from where the residual is taken."""
        return np.asarray(self.shift + self.spread * self._best(self._rows(values)))

    def joint_start(self, values: Array, low: Array, high: Array) -> Array:
        """The values from which to go on: these, or those of a joint step with the nuisance parameters, if better.

        A nuisance parameter at its limit stays there while the values move alone, and may hold what belongs to them:
        an actuator's bias then moves by a thousandth a round, where the joint step finds it at once. The joint step
        decides anew which nuisance parameters stand at their limits; those that a candidate replaces are none any more.
        Values at which predictions diverge are returned.
        """
        if (self.free | self.replaced).all():
            return values
        columns, rows = self._columns(values), self._rows(values) + self.shifted_rows
        cross, corner = self.matrix.T @ columns, columns.T @ columns + np.diag(self.sigma**-2.0)
        gram = np.block([[self.gram, cross], [cross.T, corner]])
        right = np.append(self.matrix.T @ rows, columns.T @ rows - (values - self.centre) / self.sigma**2)
        if not (np.isfinite(gram).all() and np.isfinite(right).all()) or self._active_set_holds(gram, right):
            return values
        before, deviance = (self.free, self.shift), self.deviance(values)
        limit, now = self.limit / self.spread, self.now / self.spread
        gone, away = self.replaced, self.shift / self.spread
        lower = np.append(np.where(gone, away, -limit - now), low - values)
        upper = np.append(np.where(gone, away, limit - now), high - values)
        step = bounded_least_squares(gram, right, lower, upper)
        moved = now + step[: now.size]
        beyond = ~gone & (np.abs(moved) > limit * (1.0 - _AT_LIMIT))
        shift = np.where(beyond, np.sign(moved) * self.limit - self.now, np.where(gone, self.shift, 0.0))
        self._set_free(~beyond & ~gone, shift)
        stepped_values = values + step[now.size :]
        if self.deviance(stepped_values) < deviance:
            return stepped_values
        self._set_free(*before)
        return values

    def _active_set_holds(self, gram: Array, right: Array) -> bool:
        """Whether, as everything moves, the nuisance parameters at their limits stay there and no other reaches its."""
        free, step = np.ones(right.size, bool), np.zeros(right.size)
        free[: self.now.size], step[: self.now.size] = self.free, self.shift / self.spread
        step[free] = cho_solve(cho_factor(gram[np.ix_(free, free)]), (right - gram[:, ~free] @ step[~free])[free])
        moved = self.now + self.spread * step[: self.now.size]
        pull = np.sign(moved) * (right - gram @ step)[: self.now.size]
        there = (pull >= 0.0) | self.free | self.replaced
        return bool(there.all() and ((np.abs(moved) <= self.limit * (1.0 + _AT_LIMIT)) | self.replaced).all())

    def with_candidate(self, candidate: Candidate) -> VariableProjection:
        """The same problem with one candidate more, without the nuisance parameters that it is or replaces.

        The slopes by the values that it has already are those of the fit, wherever the candidate stands.
        """
        other, simulator, nuisances = copy(self), self.fit.simulator, self.fit.nuisances
        self._own_slopes = self._own_slopes or self._slopes_by_value(self.fit.values)
        other._held, other._known, other._value_slopes = False, self._own_slopes, []
        other.indices = [*self.fit.indices, *candidate.indices]
        other._set_priors()
        kept = nuisances.without(frozenset({candidate.effect}), simulator.names).indices
        fitted = np.isin(
            nuisances.indices, candidate.indices
        )  # now a parameter that moves: from where the others start
        gone, neutral = (np.zeros(self.now.size, bool) for _ in range(2))
        for number in range(len(self.fit.flights)):
            places = nuisances.places(number)
            gone[places] |= fitted | ~np.isin(nuisances.indices, kept)
            neutral[places] |= ~fitted
        other.replaced = self.replaced | gone
        if gone.any():
            other._set_free(self.free & ~gone, np.where(gone, -self.now * neutral, self.shift))
        return other

    def _rows(self, values: Array) -> Array:
        """Weighted residuals of all flights at these values, nuisances where they are, then the nuisances' priors."""
        rows = []
        for flight in self.fit.flights:
            rows.append(real_rows(flight.model.residual(self._point(flight, values)), flight.weights).ravel())
        return np.concatenate([*rows, (self.nuisance_centre - self.now) / self.spread]) - self.shifted_rows

    def residual(self, values: Array) -> Array:
        """Rows (R,) whose sum of squares is minimised over the values (K,); the values' own priors are last."""
        rows = self._rows(values)
        return np.concatenate([rows - self.matrix @ self._best(rows), (values - self.centre) / self.sigma])

    def residual_and_slopes(self, values: Array) -> Array:
        """``residual``, where ``jacobian`` will be asked for next: the slopes are computed along with it and kept."""
        self._kept = (values.tobytes(), self._slopes(values))
        return self.residual(values)

    def jacobian(self, values: Array) -> Array:
        """Kaufman's approximate Jacobian (R, K) of ``residual``."""
        key, kept = self._kept
        return kept if key == values.tobytes() else self._slopes(values)

    def _slopes(self, values: Array) -> Array:
        matrix = -self._columns(values)
        return np.vstack([matrix - self.matrix @ self._best(matrix), np.diag(1.0 / self.sigma)])

    def _columns(self, values: Array) -> Array:
        """Weighted slopes (R, K) of what is predicted with respect to the values, nuisance parameters held."""
        if not (self._held and self._value_slopes):
            self._value_slopes = self._slopes_by_value(values)
        pairs = zip(self._value_slopes, self.fit.flights, strict=True)
        blocks = [real_rows(slopes, flight.weights).reshape(-1, values.size) for slopes, flight in pairs]
        return np.vstack([*blocks, np.zeros((self.now.size, values.size))])

    def _slopes_by_value(self, values: Array) -> list[Complex]:
        """Slopes (W, L, 12, K) by flight with respect to the values, where these stand at ``values`` (K,)."""
        known = self._known or [np.empty((*f.model.measured.shape, 0), complex) for f in self.fit.flights]
        new, pairs = self.indices[known[0].shape[3] :], zip(self.fit.flights, known, strict=True)
        return [np.concatenate([k, f.model.slopes(self._point(f, values), new)], axis=3) for f, k in pairs]

    def _point(self, flight: FlightFit, values: Array) -> Array:
        """All parameters (P,) of a flight at these values (K,), nuisance parameters where they are."""
        point = flight.point.copy()
        point[self.indices] = values
        return point

    def deviance(self, values: Array) -> float:
        """Minus twice the log posterior density at values (K,), up to a constant, the spectrum profiled out.

        With the weights held instead, an effect would be worth little just where what it explains is most of the
        residual. Nuisance parameters are within their limits, wherever they stand at other values. Infinite where the
        prediction diverged.
        """
        rows, beyond = self._rows(values), (values - self.file_centre) / self.sigma
        if not np.abs(np.concatenate([rows, beyond])).max(initial=0.0) < _DIVERGENT:
            return np.inf
        best = self._best(rows)
        moved = self.now + self.shift + self.spread * best
        if (self.free & (np.abs(moved) > self.limit * (1.0 + _AT_LIMIT))).any():
            return self._within_limits(values).deviance(values)
        rows = rows - self.matrix @ best
        squares = np.sum((moved / self.spread) ** 2) + np.sum(beyond**2)
        total, first = float(squares) + 2.0 * self.fit.log_widening, 0
        for flight, point in zip(self.fit.flights, self._placed(values, moved), strict=True):
            shape = (flight.model.windows.count, flight.weights.size)
            part = rows[first : first + shape[0] * shape[1]].reshape(shape)
            first += part.size
            power = np.mean(np.abs(amplitudes(part, flight.weights)) ** 2, axis=0)
            total += spectral_deviance(flight.model, power, point)
        return total

    def _within_limits(self, values: Array) -> VariableProjection:
        """The same problem with those nuisance parameters at their limits that would go beyond at these values."""
        other = copy(self)
        other._bind(values)
        return other

    def points(self, values: Array) -> tuple[Array, ...]:
        """All parameters (P,) by flight, with the nuisance parameters at their best for these values (K,)."""
        return self._placed(values, self.now + self._nuisance_step(values))

    def _placed(self, values: Array, nuisances: Array) -> tuple[Array, ...]:
        """All parameters (P,) by flight, with nuisance parameters that deviate from the file as far as they may."""
        moved = np.clip(nuisances, -self.limit, self.limit)
        points = []
        for number, flight in enumerate(self.fit.flights):
            point = self._point(flight, values)
            indices = list(flight.nuisances.indices)
            point[indices] = self.fit.simulator.neutral()[indices] + moved[flight.nuisances.places(number)]
            points.append(point)
        return tuple(points)
