"""Fits: the parameters of a set of candidates by least squares, the nuisances eliminated by linear algebra.

Variable projection (Golub & Pereyra (1973), SIAM J. Numer. Anal. 10(2); Kaufman's (1975) Jacobian): at given weights
the nuisances enter linearly about where they are, with their priors as further rows; what is left of residual and
slopes after projecting them out is a small nonlinear problem. Weights are the residual's own spectrum, never below the
noise of the sensors.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import least_squares, lsq_linear

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidates import Candidate, bounds, prior
from sysid_node.gap.estimation.nuisances import Nuisances
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import INDEPENDENT_SHARE, Complex, Windows

#: Weighted residual beyond which a prediction has grown without end.
_ENDLESS = 1e100

#: Most rounds of linearising the nuisances and weighing anew, and the deviance from which another changes nothing.
_ROUNDS, _SETTLED = 8, 0.3

#: Times that nuisances are put at their limits before what is left beyond is cut off.
_BINDINGS = 6

#: Room that an unknown at its limit is left, in its own standard deviations: bounds must not coincide.
_ROOM = 1e-6

#: Share of each unknown's information that tells it from others where rounding does not.
_TRACE = 1e-10

#: Share of its limit within which a nuisance stands at it.
_AT_LIMIT = 1e-6

#: Evaluations of the small nonlinear problem in each round.
_EVALUATIONS = 12


@dataclass(frozen=True)
class CandidateFit:
    """Candidates fitted to flights. Unknowns: their parameters, shared nuisances, then each flight's own."""

    models: tuple[ResidualModel, ...]
    candidates: tuple[Candidate, ...]
    nuisances: Nuisances
    points: tuple[Array, ...]  # (P,) all parameters by flight, nuisances included
    power: tuple[Array, ...]  # (L, 12) of the residual, by flight
    rows: tuple[Array, ...] = ()  # weighted residual (W, R) by flight
    slopes: tuple[Array, ...] = ()  # weighted slopes (W, R, unknowns) by flight
    information: Array | None = None  # (unknowns, unknowns)
    cost: float = np.inf

    @property
    def indices(self) -> tuple[int, ...]:
        """Entries of the vector that the candidates fit."""
        return tuple(dict.fromkeys(i for c in self.candidates for i in c.indices))

    @property
    def widened(self) -> tuple[int, ...]:
        """Entries of nuisances whose priors the candidates widen."""
        return tuple(i for c in self.candidates for i in c.widened)

    @property
    def loose(self) -> NDArray[np.bool_]:
        """Of all unknowns, those that evidence takes as uncertain.

        All but parameters that only shape an effect, and nuisances that stand at their limits.
        """
        assert self.information is not None
        loose = np.ones(self.information.shape[0], bool)
        loose[: len(self.indices)] = self.sizing
        now, _, limit = self.stacked
        loose[len(self.indices) :] = np.abs(now) < limit * (1.0 - 1e-9)
        return loose

    @property
    def sizing(self) -> NDArray[np.bool_]:
        """Which of the candidates' parameters are sizes; the others (an onset, an angle) only shape an effect."""
        return np.array([self.models[0].simulator.parameters[i][1].switch for i in self.indices], bool)

    @property
    def effects(self) -> frozenset[str]:
        """Effects that are blamed."""
        return frozenset(c.effect for c in self.candidates)

    @property
    def values(self) -> Array:
        """The candidates' parameters."""
        return np.asarray(self.points[0][list(self.indices)])

    @property
    def covariance(self) -> Array:
        """Of all unknowns."""
        assert self.information is not None
        return np.asarray(np.linalg.inv(self.information))

    @property
    def stacked(self) -> tuple[Array, Array, Array]:
        """Values (about neutral, which is zero for all), 1-sigma and limits of all flights' nuisances."""
        _, shared, own = self.sizes
        now, sigma, limit = (np.ones(shared + len(self.models) * own) for _ in range(3))
        for i, point in enumerate(self.points):
            places = _places(self.nuisances, i)
            now[places] = point[list(self.nuisances.indices)]
            sigma[places], limit[places] = self.nuisances.sigma, self.nuisances.limit
        return now, sigma, limit

    @property
    def prior_information(self) -> Array:
        """Of all unknowns (unknowns, unknowns), before any flight."""
        _, spread, _ = self.stacked
        _, sigma = prior(self.models[0].simulator, self.indices)
        return np.diag(np.concatenate([sigma, spread]) ** -2.0)

    @property
    def prior_score(self) -> float:
        """Log probability of where everything stands under its prior, up to a constant: nats, zero at best."""
        now, sigma, _ = self.stacked
        centre, own = prior(self.models[0].simulator, self.indices)
        far = float(np.sum((now / sigma) ** 2) + np.sum(((self.values - centre) / own) ** 2))
        return -0.5 * far - self.nuisances.widened

    @property
    def sizes(self) -> tuple[int, int, int]:
        """How many unknowns: the candidates', shared, each flight's own."""
        shared = int(self.nuisances.shared.sum())
        return len(self.indices), shared, len(self.nuisances.indices) - shared


def weights(windows: Windows, power: Array) -> Array:
    """Weights (2 L, 12) of real and imaginary parts; the mean has no imaginary part."""
    w = np.sqrt(2.0 * INDEPENDENT_SHARE / power)
    w[0] *= np.sqrt(0.5)
    imaginary = w.copy()
    imaginary[0] = 0.0
    return np.concatenate([w, imaginary])


def real_rows(amplitudes: Complex, weight: Array) -> Array:
    """Amplitudes (W, L, 12, ...) as weighted real rows (W, R, ...)."""
    parts = np.concatenate([amplitudes.real, amplitudes.imag], axis=1)
    parts = parts * weight.reshape(1, *weight.shape, *(1,) * (parts.ndim - 3))
    return np.asarray(parts.reshape(parts.shape[0], -1, *parts.shape[3:]))


def amplitudes(rows: Array, weight: Array) -> Complex:
    """Weighted real rows (w, R) as amplitudes (w, L, 12) again."""
    parts = rows.reshape(rows.shape[0], 2, -1, len(CHANNELS))
    weight = weight.reshape(2, -1, len(CHANNELS))
    raw = np.where(weight > 0, parts / np.where(weight > 0, weight, 1.0), 0.0)
    return np.asarray(raw[:, 0] + 1j * raw[:, 1])


def residual_power(model: ResidualModel, residual: Complex) -> Array:
    """Power (L, 12) of a residual (W, L, 12), smoothed by band, at least the sensors' noise."""
    power = model.windows.smoothed((np.abs(residual) ** 2).mean(axis=0))
    return np.where(model.axes, np.maximum(power, model.noise), 1.0)


def unfitted(models: Sequence[ResidualModel], nuisances: Nuisances) -> CandidateFit:
    """Nothing blamed, nothing fitted yet."""
    points = tuple(model.simulator.neutral() for model in models)
    power = tuple(residual_power(v, v.residual(p)) for v, p in zip(models, points, strict=True))
    return CandidateFit(tuple(models), (), nuisances, points, power)


def with_candidates(
    fit: CandidateFit, candidates: Sequence[Candidate], nuisances: Nuisances, start: Sequence[float]
) -> CandidateFit:
    """Another set of candidates about where this fit stands; those it did not have at ``start``,
    all else neutral."""
    model = fit.models[0]
    names, neutral = model.simulator.names, model.simulator.neutral()
    widened = tuple(i for c in candidates for i in c.widened)
    kept = nuisances.without(frozenset(c.effect for c in candidates), names, widened)
    old, chosen = set(fit.indices), {i for c in candidates for i in c.indices}
    points = []
    for point in fit.points:
        fresh = point.copy()
        gone = (old | set(fit.nuisances.indices)) - chosen  # what made up for an effect would hide it
        fresh[list(gone)] = neutral[list(gone)]
        new = [i for c in candidates for i in c.indices if i not in old]
        fresh[new] = list(start)
        points.append(fresh)
    return replace(fit, candidates=tuple(candidates), nuisances=kept, points=tuple(points), rows=(), slopes=(),
                   information=None, cost=np.inf)  # fmt: skip


def converged(fit: CandidateFit, rounds: int = _ROUNDS) -> CandidateFit:
    """The fit with everything it can move moved, and its weights those of its own residual.

    Weights and nuisances of one round may throw the next one back: the likeliest counts.
    """
    best, least, last = fit, np.inf, np.inf
    for _ in range(rounds):
        fit = _one_round(fit)
        residuals = [v.residual(p) for v, p in zip(fit.models, fit.points, strict=True)]
        fit = replace(fit, power=tuple(residual_power(v, r) for v, r in zip(fit.models, residuals, strict=True)))
        raw = ((np.abs(residual) ** 2).mean(axis=0) for residual in residuals)
        deviance = sum(_deviance(v, p) for v, p in zip(fit.models, raw, strict=True)) - 2.0 * fit.prior_score
        if not deviance >= least:
            best, least = fit, deviance
        if not abs(deviance - last) >= _SETTLED:
            break
        last = deviance
    return linearised(best)


def _deviance(model: ResidualModel, power: Array) -> float:
    """Minus twice the log probability, up to a constant, of a remainder of power (L, 12), as of its own spectrum."""
    floor = np.where(model.axes, np.maximum(model.windows.smoothed(power), model.noise), 1.0)
    lines = np.ones((power.shape[0], 1))
    lines[0] = 0.5
    return 2.0 * INDEPENDENT_SHARE * model.windows.count * float(np.sum(lines * (np.log(floor) + power / floor)))


def _one_round(fit: CandidateFit) -> CandidateFit:
    problem = VariableProjection(fit)
    values = fit.values
    if values.size:
        low, high = bounds(fit.models[0].simulator, fit.indices)
        start = np.clip(problem.together(values, low, high), low + 1e-9, high - 1e-9)
        if not np.isfinite(problem.ahead(start)).all():
            raise np.linalg.LinAlgError("the prediction grows without end")  # as slopes that do
        scale = fit.models[0].simulator.scales[list(fit.indices)]
        solution = least_squares(
            problem.ahead, start, problem.jacobian, bounds=(low, high), x_scale=scale, max_nfev=_EVALUATIONS,
            ftol=1e-4, xtol=1e-4, gtol=1e-6,
        )  # fmt: skip
        values = solution.x
    return replace(fit, points=problem.points(values))


class VariableProjection:
    """What is left of the residual at the candidates' parameters when the nuisances do their best.

    Nuisances that would go beyond their limits at the fit's values are put there and stay: an active set, found anew
    for each linearisation. Nuisances are in units of their sigmas here: their priors are then a unit matrix, and the
    normal equations are sound however little the flight says of some.
    """

    def __init__(self, fit: CandidateFit) -> None:
        self.fit, self.weights = fit, [weights(v.windows, p) for v, p in zip(fit.models, fit.power, strict=True)]
        own = list(fit.nuisances.indices)
        blocks = []
        for i, (model, point, weight) in enumerate(zip(fit.models, fit.points, self.weights, strict=True)):
            slopes = real_rows(model.slopes(point, own), weight)
            blocks.append(_placed(slopes.reshape(-1, len(own)), fit.nuisances, i, len(fit.models)))
        self.now, self.spread, self.limit = fit.stacked
        self.matrix = np.vstack([*(block * self.spread for block in blocks), np.eye(self.now.size)])
        self.gram = self.matrix.T @ self.matrix
        self.indices = list(fit.indices)
        self.centre, self.sigma = prior(fit.models[0].simulator, fit.indices)
        self._kept = (b"", np.empty((0, 0)))
        self._settle(np.ones(self.now.size, bool), np.zeros(self.now.size))
        self._bind(fit.values)

    def _settle(self, free: NDArray[np.bool_], shift: Array) -> None:
        """Which nuisances may move, and how far the others stand from where the residual is taken."""
        self.free, self.shift = free, shift
        self.moved_rows = self.matrix @ (shift / self.spread)
        self.factor = cho_factor(self.gram[np.ix_(free, free)], check_finite=False)

    def _best(self, rows: Array) -> Array:
        """Nuisances (K, ...), in sigmas, that do most against rows (R, ...); those that may not move, zero."""
        best = np.zeros((self.now.size, *rows.shape[1:]))
        best[self.free] = cho_solve(self.factor, (self.matrix.T @ rows)[self.free], check_finite=False)
        return best

    def _bind(self, values: Array) -> None:
        """Puts at their limits those that would go beyond, until none would."""
        for _ in range(_BINDINGS):
            there = self.now + self._step(values)
            beyond = self.free & (np.abs(there) > self.limit)
            if not beyond.any():
                return
            shift = np.where(beyond, np.sign(there) * self.limit - self.now, self.shift)
            self._settle(self.free & ~beyond, shift)

    def _step(self, values: Array) -> Array:
        """How far the nuisances' best at these values lies from where the residual is taken."""
        return np.asarray(self.shift + self.spread * self._best(self._rows(values)))

    def together(self, values: Array, low: Array, high: Array) -> Array:
        """The values from which to go on: these, or those of a step in which nuisances move with them, if it is better.

        A nuisance at its limit stays there while the values move alone, and may hold what is theirs: an elevator's bias
        crept by a thousandth a round where this step finds it. Nuisances are bound as it leaves them.
        """
        if self.free.all():
            return values
        columns, rows = self._columns(values), self._rows(values) + self.moved_rows
        both, own = self.matrix.T @ columns, columns.T @ columns + np.diag(self.sigma**-2.0)
        gram = np.block([[self.gram, both], [both.T, own]])
        right = np.append(self.matrix.T @ rows, columns.T @ rows - (values - self.centre) / self.sigma**2)
        if self._stays(gram, right):
            return values
        before, here = (self.free, self.shift), self.deviance(self.residual(values))
        limit, now = self.limit / self.spread, self.now / self.spread
        step = bounded_least_squares(
            gram, right, np.append(-limit - now, low - values), np.append(limit - now, high - values)
        )
        stepped = now + step[: now.size]
        beyond = np.abs(stepped) > limit * (1.0 - _AT_LIMIT)
        self._settle(~beyond, np.where(beyond, np.sign(stepped) * self.limit - self.now, 0.0))
        there = values + step[now.size :]
        if self.deviance(self.residual(there)) < here:
            return there
        self._settle(*before)
        return values

    def _stays(self, gram: Array, right: Array) -> bool:
        """Whether the nuisances at their limits would stay there, and no other reach its own, as all else moves."""
        free, step = np.ones(right.size, bool), np.zeros(right.size)
        free[: self.now.size], step[: self.now.size] = self.free, self.shift / self.spread
        step[free] = cho_solve(cho_factor(gram[np.ix_(free, free)]), (right - gram[:, ~free] @ step[~free])[free])
        stepped = self.now + self.spread * step[: self.now.size]
        pull = np.sign(stepped) * (right - gram @ step)[: self.now.size]
        return bool((pull[~self.free] >= 0.0).all() and (np.abs(stepped) <= self.limit * (1.0 + _AT_LIMIT)).all())

    def looking(self, candidate: Candidate) -> VariableProjection:
        """The same nuisances but for those that the candidate is or replaces; its parameters move with the others."""
        other, names = copy(self), self.fit.models[0].simulator.names
        other.indices = [*self.fit.indices, *candidate.indices]
        other.centre, other.sigma = prior(self.fit.models[0].simulator, other.indices)
        nuisances = self.fit.nuisances
        kept = nuisances.without(frozenset({candidate.effect}), names).indices
        own = np.isin(nuisances.indices, candidate.indices)  # now a parameter that moves: from where the others start
        gone, neutral = (np.zeros(self.now.size, bool) for _ in range(2))
        for flight in range(len(self.fit.models)):
            places = _places(nuisances, flight)
            gone[places] |= own | ~np.isin(nuisances.indices, kept)
            neutral[places] |= ~own
        if gone.any():
            other._settle(self.free & ~gone, np.where(gone, -self.now * neutral, self.shift))
        return other

    def _rows(self, values: Array) -> Array:
        """Weighted residuals of all flights at these values, nuisances where they are, then the nuisances' priors."""
        rows = []
        for model, point, weight in zip(self.fit.models, self.fit.points, self.weights, strict=True):
            there = point.copy()
            there[self.indices] = values
            rows.append(real_rows(model.residual(there), weight).ravel())
        return np.concatenate([*rows, -self.now / self.spread]) - self.moved_rows

    def residual(self, values: Array) -> Array:
        """Rows to be made small, the parameters' own priors last."""
        rows = self._rows(values)
        return np.concatenate([rows - self.matrix @ self._best(rows), (values - self.centre) / self.sigma])

    def ahead(self, values: Array) -> Array:
        """``residual`` where its slopes will be wanted, too: they are worked out along with it and kept."""
        self._kept = (values.tobytes(), self._slopes(values))
        return self.residual(values)

    def jacobian(self, values: Array) -> Array:
        """Slopes of ``residual``, Kaufman's."""
        key, kept = self._kept
        return kept if key == values.tobytes() else self._slopes(values)

    def _slopes(self, values: Array) -> Array:
        matrix = -self._columns(values)
        return np.vstack([matrix - self.matrix @ self._best(matrix), np.diag(1.0 / self.sigma)])

    def _columns(self, values: Array) -> Array:
        """Weighted slopes (R, values) of what is expected with respect to the values, nuisances held."""
        blocks = []
        for model, point, weight in zip(self.fit.models, self.fit.points, self.weights, strict=True):
            there = point.copy()
            there[self.indices] = values
            blocks.append(real_rows(model.slopes(there, self.indices), weight).reshape(-1, values.size))
        return np.vstack([*blocks, np.zeros((self.now.size, values.size))])

    def deviance(self, rows: Array) -> float:
        """Minus twice the log probability of a ``residual``, up to a constant, as if of its own spectrum.

        The spectrum is profiled out: with the weights as they are, an effect would be worth little just where what it
        explains is most of the remainder. Infinite where the prediction grew without end.
        """
        if not np.abs(rows).max(initial=0.0) < _ENDLESS:
            return np.inf
        data = sum(
            model.windows.count * weight.size for model, weight in zip(self.fit.models, self.weights, strict=True)
        )
        total, first = float(np.sum(rows[data:] ** 2)) + 2.0 * self.fit.nuisances.widened, 0
        for model, weight in zip(self.fit.models, self.weights, strict=True):
            shape = (model.windows.count, weight.size)
            own = rows[first : first + shape[0] * shape[1]].reshape(shape)
            first += own.size
            total += _deviance(model, np.mean(np.abs(amplitudes(own, weight)) ** 2, axis=0))
        return total

    def points(self, values: Array) -> tuple[Array, ...]:
        """All parameters by flight, with the nuisances' best at these values."""
        stepped = np.clip(self.now + self._step(values), -self.limit, self.limit)
        points = []
        for i, point in enumerate(self.fit.points):
            fresh = point.copy()
            fresh[self.indices] = values
            fresh[list(self.fit.nuisances.indices)] = stepped[_places(self.fit.nuisances, i)]
            points.append(fresh)
        return tuple(points)


def _places(nuisances: Nuisances, flight: int) -> NDArray[np.intp]:
    """Where a flight's nuisances stand among all flights': the shared ones first."""
    shared = int(nuisances.shared.sum())
    own = len(nuisances.indices) - shared
    places = np.empty(len(nuisances.indices), np.intp)
    places[nuisances.shared] = np.arange(shared)
    places[~nuisances.shared] = shared + flight * own + np.arange(own)
    return places


def _placed(slopes: Array, nuisances: Nuisances, flight: int, flights: int) -> Array:
    """A flight's slopes (n, K) among the columns of all flights."""
    shared = int(nuisances.shared.sum())
    wide = np.zeros((slopes.shape[0], shared + flights * (len(nuisances.indices) - shared)))
    wide[:, _places(nuisances, flight)] = slopes
    return wide


def stepped(fit: CandidateFit, step: Array) -> CandidateFit:
    """The fit with all unknowns a step (unknowns,) on, the candidates' within their bounds."""
    chosen = list(fit.indices)
    low, high = bounds(fit.models[0].simulator, chosen)
    own, limit, points = list(fit.nuisances.indices), fit.nuisances.limit, []
    for i, point in enumerate(fit.points):
        fresh = point.copy()
        fresh[chosen] = np.clip(point[chosen] + step[: len(chosen)], low, high)
        fresh[own] = np.clip(point[own] + step[len(chosen) + _places(fit.nuisances, i)], -limit, limit)
        points.append(fresh)
    return replace(fit, points=tuple(points))


def linearised(fit: CandidateFit) -> CandidateFit:
    """The fit with its residual, slopes and information where it stands, for evidence and errors.

    An onset has no slope but at the very moment: what it has there would make all others as uncertain as it is.
    """
    own, chosen = list(fit.nuisances.indices), list(fit.indices)
    rows, slopes = [], []
    for i, (model, point, power) in enumerate(zip(fit.models, fit.points, fit.power, strict=True)):
        weight = weights(model.windows, power)
        raw = real_rows(model.slopes(point, [*chosen, *own]), weight)
        raw[..., onset_places(fit)] = 0.0
        rows.append(real_rows(model.residual(point), weight))
        wide = _placed(raw[..., len(chosen) :].reshape(-1, len(own)), fit.nuisances, i, len(fit.models))
        slopes.append(np.concatenate([raw[..., : len(chosen)], wide.reshape(*raw.shape[:2], -1)], axis=2))
    information = fit.prior_information
    for block in slopes:
        flat = block.reshape(-1, block.shape[2])
        information += flat.T @ flat
    cost = sum(float(np.sum(r**2)) for r in rows) - 2.0 * fit.prior_score
    return replace(fit, rows=tuple(rows), slopes=tuple(slopes), information=information, cost=cost)


def onset_places(fit: CandidateFit) -> list[int]:
    """Places of the times at which something begins, among the unknowns."""
    return [k for k, i in enumerate(fit.indices) if fit.models[0].simulator.parameters[i][1].name == "onset"]


def step_limits(fit: CandidateFit) -> tuple[Array, Array]:
    """Least and greatest step of each unknown within its limits; what only shapes an effect stays.

    Part of a flight may say nothing of an onset, and a linear step would then lead anywhere.
    """
    low, high = bounds(fit.models[0].simulator, fit.indices)
    now, _, limit = fit.stacked
    least, greatest = (np.where(fit.sizing, end - fit.values, 0.0) for end in (low, high))
    return np.append(least, -limit - now), np.append(greatest, limit - now)


def bounded_least_squares(information: Array, right: Array, low: Array, high: Array) -> Array:
    """The step (unknowns,) of least squares, information @ step = right, between bounds."""
    spread = np.diag(information) ** -0.5
    root = _root(information * np.outer(spread, spread))
    target = np.linalg.solve(root.T, right * spread)
    found = lsq_linear(root, target, (np.minimum(low / spread, -_ROOM), np.maximum(high / spread, _ROOM)))
    return np.asarray(found.x * spread)


def _root(information: Array) -> Array:
    """Upper factor R (K, K) of information = R' R (K, K), whose diagonal is one.

    Where slopes are so large, and so alike, that rounding drowns the priors, a trace of these is added again.
    """
    try:
        return np.asarray(np.linalg.cholesky(information).T)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.cholesky(information + _TRACE * np.eye(len(information))).T)


def solve(information: Array, right: Array) -> Array:
    """information^-1 right, of a symmetric positive definite matrix."""
    solved: Array = cho_solve(cho_factor(information), right)
    return solved
