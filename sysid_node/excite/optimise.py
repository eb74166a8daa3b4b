"""The amplitudes and the timing of a manoeuvre with the least predicted errors, within limits.

The cost is Bayesian A-optimal (Mehra, IEEE Trans. Autom. Control 19 (1974); Chaloner & Verdinelli, Statist. Sci. 10
(1995)): the root mean square, over the derivatives, of the posterior standard deviation divided by the prior one (the
tolerance). The search is by COBYQA (Ragonneau & Zhang 2022), which needs no derivatives and respects constraints: the
cost changes in small jumps with the start and the end of a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from sysid_node.errors import InputError
from sysid_node.excite.information import FisherInformation
from sysid_node.excite.prediction import Prediction, Predictor, tolerances_of
from sysid_node.excite.search_space import SearchSpace
from sysid_node.excite.segment import ManoeuvreSegment, as_written
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]

#: Excess of a flight that cannot be predicted: far larger than that of any other.
_INFEASIBLE = 1e6
#: A derivative counts where the start reduces its standard deviation to less than this share of its tolerance.
_OBSERVED = 0.9


@dataclass(frozen=True)
class FlightEnvelope:
    """The largest departures from trim: angles in rad, any angular rate in rad/s, airspeed as a share of trim's."""

    alpha: float = 0.10
    beta: float = 0.15
    bank: float = 0.8
    pitch: float = 0.5
    rate: float = 2.0
    airspeed: float = 0.25

    def excess(self, y: FlightRecord) -> dict[str, float]:
        """The largest departure over its limit, less one, by limit; at most zero inside the envelope."""
        departures = {
            "alpha": y["alpha"] - y["alpha"][0],
            "beta": y["beta"] - y["beta"][0],
            "bank": y["phi"],
            "pitch": y["theta"] - y["theta"][0],
            "rate": np.array([y["p"], y["q"], y["r"]]),
            "airspeed": y["V"] / y["V"][0] - 1.0,
        }
        return {name: float(np.abs(v).max()) / getattr(self, name) - 1.0 for name, v in departures.items()}


@dataclass(frozen=True)
class Optimum:
    """The outcome. ``cost_*`` are root mean squares of posterior over prior standard deviation, over ``counted``."""

    start: Prediction
    best: Prediction
    counted: tuple[str, ...]  # derivatives that the start observes at all
    cost_start: float
    cost_best: float
    evaluations: int


def posterior_to_prior_ratios(information: FisherInformation, tolerances: Array) -> Array:
    """Posterior over prior standard deviation (P,): flight and aircraft file together, over the file; 1: no gain."""
    scaled = tolerances[:, None] * information.matrix * tolerances
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(scaled + np.eye(len(tolerances))))))


def optimise(
    predictor: Predictor,
    segments: Sequence[ManoeuvreSegment],
    duration: float,
    envelope: FlightEnvelope | None = None,
    evaluations: int = 200,
    progress: Callable[[int, float], None] | None = None,
) -> Optimum:
    """The best manoeuvre of the form of ``segments`` within ``duration`` (s), the envelope and the controls' travel.

    Amplitudes, beginnings and, of steps, widths are free. ``progress(evaluations, best cost)`` is called as it goes.
    Raises InputError where the start cannot be flown, or leaves the envelope however small it is.
    """
    start = predictor.predict(predictor.draw(segments, duration))
    search = _Search(predictor, segments, duration, envelope or FlightEnvelope(), start, progress)
    minimize(
        search.cost,
        search.begin(),
        method="COBYQA",
        bounds=Bounds(np.zeros(search.space.size), np.ones(search.space.size)),
        constraints=NonlinearConstraint(search.excess, -np.inf, 0.0),
        options={"maxfev": evaluations, "initial_tr_radius": 0.15, "final_tr_radius": 1e-3},
    )
    assert search.best is not None
    counted = tuple(name for name, counts in zip(predictor.names, search.counted, strict=True) if counts)
    cost_start = search.posterior_ratio(start)
    return Optimum(start, search.best, counted, cost_start, search.best_cost, search.count)


class _Search:
    """Cost and constraints as functions of a point in the unit cube, with the best flight so far."""

    def __init__(
        self,
        predictor: Predictor,
        segments: Sequence[ManoeuvreSegment],
        duration: float,
        envelope: FlightEnvelope,
        start: Prediction,
        progress: Callable[[int, float], None] | None,
    ) -> None:
        self.space = SearchSpace(predictor, segments, duration)
        self.envelope, self.progress = envelope, progress
        self._tolerances = tolerances_of(predictor.aircraft)
        observed = posterior_to_prior_ratios(start.information, self._tolerances) < _OBSERVED
        self.counted = observed if observed.any() else np.ones(len(observed), dtype=bool)
        self.best: Prediction | None = None
        self.best_cost = np.inf
        self.count = 0
        self._cache: dict[bytes, tuple[float, Array]] = {}

    def posterior_ratio(self, prediction: Prediction) -> float:
        """The root mean square of posterior over prior standard deviation, over the derivatives that count."""
        return float(
            np.sqrt(np.mean(posterior_to_prior_ratios(prediction.information, self._tolerances)[self.counted] ** 2))
        )

    def begin(self) -> Array:
        """The start as a point (size,), its amplitudes halved until the flight stays within the envelope."""
        point = self.space.encode(self.space.segments)
        for _ in range(12):
            if self.excess(point).max() <= 0:
                return point
            halved = [replace(s, amplitude=tuple(0.5 * a for a in s.amplitude)) for s in self.space.decode(point)]
            point = self.space.encode(halved)
        spec = as_written(self.space.segments)
        raise InputError(f"manoeuvre {spec!r}: leaves the envelope however small its amplitudes; allow a wider one")

    def cost(self, point: Array) -> float:
        """The logarithm of ``posterior_ratio``, which is smoother."""
        return self._evaluate(point)[0]

    def excess(self, point: Array) -> Array:
        """The envelope's excess (6,)."""
        return self._evaluate(point)[1]

    def _evaluate(self, point: Array) -> tuple[float, Array]:
        """Cost and excess, cached: the optimiser asks for both at each point, and for some points again."""
        key = np.asarray(point).tobytes()
        if key not in self._cache:
            self._cache[key] = self._fly(point)
        return self._cache[key]

    def _fly(self, point: Array) -> tuple[float, Array]:
        self.count += 1
        predictor = self.space.predictor
        try:
            prediction = predictor.predict(predictor.draw(self.space.decode(point), self.space.duration))
        except InputError:  # beyond the travel, or diverged
            return 0.0, np.full(6, _INFEASIBLE)
        cost = self.posterior_ratio(prediction)
        excess = np.array(list(self.envelope.excess(prediction.flight).values()))
        if excess.max() <= 0 and cost < self.best_cost:
            self.best, self.best_cost = prediction, cost
        if self.progress is not None:
            self.progress(self.count, self.best_cost)
        return float(np.log(cost)), excess
