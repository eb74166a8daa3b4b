"""Shape a manoeuvre's amplitudes and timing for the least predicted error, within limits.

The cost is Bayesian A-optimal (Mehra, IEEE Trans. Autom. Control 19 (1974); Chaloner & Verdinelli, Statist. Sci. 10
(1995)): the root mean square of what is left of each derivative's tolerance once the flight is known. Search by COBYQA
(Ragonneau & Zhang 2022), which needs no derivatives and keeps constraints: where a step begins and ends moves the cost
in small jumps.
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
from sysid_node.excite.spec import Segment
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]

#: Excess where a flight cannot be predicted: far worse than any that can.
_HOPELESS = 1e6
#: A derivative counts where the start leaves less than this share of its tolerance.
_SHOWN = 0.9


@dataclass(frozen=True)
class FlightEnvelope:
    """How far a flight may stray from trim: angles rad, any angular rate rad/s, airspeed as a share of trim's."""

    alpha: float = 0.10
    beta: float = 0.15
    bank: float = 0.8
    pitch: float = 0.5
    rate: float = 2.0
    airspeed: float = 0.25

    def excess(self, y: FlightRecord) -> dict[str, float]:
        """Largest departure over its limit, less one, by limit; not above zero inside."""
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
    """What an optimisation found. ``cost_*`` are the share of the tolerances that is left, over ``counted``."""

    start: Prediction
    best: Prediction
    counted: tuple[str, ...]  # derivatives that the start shows at all: whose errors are to fall
    cost_start: float
    cost_best: float
    evaluations: int


def posterior_to_prior_ratios(information: FisherInformation, tolerances: Array) -> Array:
    """Standard error over tolerance (P,) once the flight and the aircraft file are both known: 1, nothing learnt."""
    scaled = tolerances[:, None] * information.matrix * tolerances
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(scaled + np.eye(len(tolerances))))))


def optimise(
    predictor: Predictor,
    segments: Sequence[Segment],
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
    cost_start = search.left(start)
    return Optimum(start, search.best, counted, cost_start, search.best_cost, search.count)


class _Search:
    """The cost and the constraints as functions of a point in the unit cube, and the best flight so far."""

    def __init__(
        self,
        predictor: Predictor,
        segments: Sequence[Segment],
        duration: float,
        envelope: FlightEnvelope,
        start: Prediction,
        progress: Callable[[int, float], None] | None,
    ) -> None:
        self.space = SearchSpace(predictor, segments, duration)
        self.envelope, self.progress = envelope, progress
        self._tolerances = tolerances_of(predictor.aircraft)
        shown = posterior_to_prior_ratios(start.information, self._tolerances) < _SHOWN
        self.counted = shown if shown.any() else np.ones(len(shown), dtype=bool)
        self.best: Prediction | None = None
        self.best_cost = np.inf
        self.count = 0
        self._known: dict[bytes, tuple[float, Array]] = {}

    def left(self, prediction: Prediction) -> float:
        """Root mean square share of the counted tolerances that this flight leaves."""
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
        spec = "+".join(segment.text() for segment in self.space.segments)
        raise InputError(f"manoeuvre {spec!r}: leaves the envelope however small its amplitudes; allow a wider one")

    def cost(self, point: Array) -> float:
        """Logarithm of what is left: smoother."""
        return self._evaluate(point)[0]

    def excess(self, point: Array) -> Array:
        """The envelope's excess (6,)."""
        return self._evaluate(point)[1]

    def _evaluate(self, point: Array) -> tuple[float, Array]:
        """Cost and excess; both are asked for at each point, and at some points again, so answers are kept."""
        key = np.asarray(point).tobytes()
        if key not in self._known:
            self._known[key] = self._fly(point)
        return self._known[key]

    def _fly(self, point: Array) -> tuple[float, Array]:
        self.count += 1
        predictor = self.space.predictor
        try:
            prediction = predictor.predict(predictor.draw(self.space.decode(point), self.space.duration))
        except InputError:  # beyond the travel, or diverged: worse than any that can be flown
            return 0.0, np.full(6, _HOPELESS)
        cost = self.left(prediction)
        excess = np.array(list(self.envelope.excess(prediction.flight).values()))
        if excess.max() <= 0 and cost < self.best_cost:
            self.best, self.best_cost = prediction, cost
        if self.progress is not None:
            self.progress(self.count, self.best_cost)
        return float(np.log(cost)), excess
