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
from sysid_node.excite.information import Information
from sysid_node.excite.manoeuvre import control_limits
from sysid_node.excite.prediction import Prediction, Predictor, tolerances_of
from sysid_node.excite.spec import Segment, draw_manoeuvre
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]

#: Excess where a flight cannot be predicted: far worse than any that can.
_HOPELESS = 1e6
#: A derivative counts where the start leaves less than this share of its tolerance.
_SHOWN = 0.9
#: Steps last between these (s); amplitudes lie between these shares of the control's travel. Both are searched in
#: logarithms.
_WIDTHS = (0.1, 2.0)
_SHARES = (0.01, 0.95)
#: Trim is flown for so long first (s).
_LEAD = 1.0


@dataclass(frozen=True)
class Envelope:
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


def shares_left(information: Information, tolerances: Array) -> Array:
    """Standard error over tolerance (P,) once the flight and the aircraft file are both known: 1, nothing learnt."""
    scaled = tolerances[:, None] * information.matrix * tolerances
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(scaled + np.eye(len(tolerances))))))


def optimise(
    predictor: Predictor,
    segments: Sequence[Segment],
    duration: float,
    envelope: Envelope | None = None,
    evaluations: int = 200,
    progress: Callable[[int, float], None] | None = None,
) -> Optimum:
    """The best manoeuvre of the form of ``segments`` within ``duration`` (s), the envelope and the controls' travel.

    Amplitudes, beginnings and, of steps, widths are free. ``progress(evaluations, best cost)`` is called as it goes.
    Raises InputError where the start cannot be flown, or leaves the envelope however small it is.
    """
    start = predictor.predict(draw_manoeuvre(segments, predictor.aircraft, predictor.simulator.rate, duration))
    search = _Search(predictor, segments, duration, envelope or Envelope(), start, progress)
    minimize(
        search.cost,
        search.begin(),
        method="COBYQA",
        bounds=Bounds(np.zeros(search.size), np.ones(search.size)),
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
        envelope: Envelope,
        start: Prediction,
        progress: Callable[[int, float], None] | None,
    ) -> None:
        self.predictor, self.segments, self.duration, self.envelope = predictor, segments, duration, envelope
        self.progress = progress
        self._tolerances = tolerances_of(predictor.aircraft)
        shown = shares_left(start.information, self._tolerances) < _SHOWN
        self.counted = shown if shown.any() else np.ones(len(shown), dtype=bool)
        self.best: Prediction | None = None
        self.best_cost = np.inf
        self.count = 0
        self._travel = _travel(predictor)
        self._known: dict[bytes, tuple[float, Array]] = {}
        self.size = sum(len(segment.controls) + 1 + ("width" in segment.values) for segment in segments)

    def left(self, prediction: Prediction) -> float:
        """Root mean square share of the counted tolerances that this flight leaves."""
        return float(np.sqrt(np.mean(shares_left(prediction.information, self._tolerances)[self.counted] ** 2)))

    def begin(self) -> Array:
        """The start as a point (size,), its amplitudes halved until the flight stays within the envelope."""
        point = self.encode(self.segments)
        for _ in range(12):
            if self.excess(point).max() <= 0:
                return point
            halved = [replace(s, amplitude=tuple(0.5 * a for a in s.amplitude)) for s in self.decode(point)]
            point = self.encode(halved)
        raise InputError(
            f"manoeuvre {'+'.join(segment.text() for segment in self.segments)!r}: leaves the envelope however small "
            "its amplitudes; allow a wider one"
        )

    def encode(self, segments: Sequence[Segment]) -> Array:
        """The point (size,) of these segments."""
        point: list[float] = []
        for segment in segments:
            for control, amplitude in zip(segment.controls, segment.amplitude, strict=True):
                point.append(_place(abs(amplitude) / self._travel[control], *_SHARES))
            if "width" in segment.values:
                point.append(_place(segment.values["width"], *_WIDTHS))
            point.append((segment.values["start"] - _LEAD) / max(self._room(segment), 1e-9))
        return np.clip(point, 0.0, 1.0)

    def decode(self, point: Array) -> list[Segment]:
        """The segments of a point, in numbers of four decimals: what is flown is what the spec says."""
        values = iter(np.clip(point, 0.0, 1.0))
        found: list[Segment] = []
        for segment in self.segments:
            shares = [_value(next(values), *_SHARES) for _ in segment.controls]
            amplitude = tuple(
                _round(float(np.sign(a) or 1.0) * share * self._travel[c])
                for a, share, c in zip(segment.amplitude, shares, segment.controls, strict=True)
            )
            changed = dict(segment.values)
            if "width" in changed:
                changed["width"] = _round(_value(next(values), *_WIDTHS))
            moved = replace(segment, amplitude=amplitude, values=changed)
            changed["start"] = _round(_LEAD + next(values) * self._room(moved))
            found.append(replace(moved, values=changed))
        return found

    def cost(self, point: Array) -> float:
        """Logarithm of what is left: smoother."""
        return self._evaluate(point)[0]

    def excess(self, point: Array) -> Array:
        """The envelope's excess (6,)."""
        return self._evaluate(point)[1]

    def _room(self, segment: Segment) -> float:
        """How much later (s) than the lead the segment may begin to end in time."""
        return max(self.duration - (segment.end - segment.values["start"]) - _LEAD, 0.0)

    def _evaluate(self, point: Array) -> tuple[float, Array]:
        """Cost and excess; both are asked for at each point, and at some points again, so answers are kept."""
        key = np.asarray(point).tobytes()
        if key not in self._known:
            self._known[key] = self._fly(point)
        return self._known[key]

    def _fly(self, point: Array) -> tuple[float, Array]:
        self.count += 1
        try:
            manoeuvre = draw_manoeuvre(
                self.decode(point), self.predictor.aircraft, self.predictor.simulator.rate, self.duration
            )
            prediction = self.predictor.predict(manoeuvre)
        except InputError:  # beyond the travel, or diverged: worse than any that can be flown
            return 0.0, np.full(6, _HOPELESS)
        cost = self.left(prediction)
        excess = np.array(list(self.envelope.excess(prediction.flight).values()))
        if excess.max() <= 0 and cost < self.best_cost:
            self.best, self.best_cost = prediction, cost
        if self.progress is not None:
            self.progress(self.count, self.best_cost)
        return float(np.log(cost)), excess


def _travel(predictor: Predictor) -> dict[str, float]:
    """How far each control may move from trim, either way; half a radian, or half throttle, where nothing limits it."""
    limits = control_limits(predictor.aircraft)
    trim = dict(zip(predictor.aircraft.controls, predictor.trim.command, strict=False))
    return {name: (limit - abs(trim.get(name, 0.0))) if np.isfinite(limit) else 0.5 for name, limit in limits.items()}


def _place(value: float, low: float, high: float) -> float:
    """Where a value lies between low and high, in logarithms: 0 to 1."""
    return float(np.log(max(value, low) / low) / np.log(high / low))


def _value(place: float, low: float, high: float) -> float:
    """The inverse of ``_place``."""
    return float(low * (high / low) ** place)


def _round(value: float) -> float:
    return round(value, 4)
