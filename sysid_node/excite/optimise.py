"""Shape a manoeuvre's amplitudes and timing for the least predicted error, within limits.

The cost is A-optimal: the mean square of predicted standard errors, each over how far its derivative may be off
(Mehra, IEEE Trans. Autom. Control 19 (1974); Mulder, TU Delft (1986)). Search by COBYQA (Ragonneau & Zhang 2022), which
needs no derivatives and keeps constraints: where a step begins and ends moves the cost in small jumps.
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
from sysid_node.excite.prediction import Prediction, Predictor
from sysid_node.excite.spec import Segment, draw_manoeuvre

Array = NDArray[np.float64]

#: Cost and excess where a flight cannot be predicted: far worse than any that can.
_HOPELESS = 1e6
#: Steps last between these (s); amplitudes lie between these shares of the control's travel.
_WIDTHS = (0.1, 2.0)
_SHARES = (0.02, 0.95)


@dataclass(frozen=True)
class Envelope:
    """How far a flight may stray from trim: angles rad, airspeed as a share of trim's."""

    alpha: float = 0.10
    beta: float = 0.15
    bank: float = 0.8
    pitch: float = 0.5
    airspeed: float = 0.25

    def excess(self, prediction: Prediction, outputs: Sequence[str]) -> Array:
        """Largest departure over its limit, less one, for each limit: (5,), not above zero inside."""
        y = {name: prediction.outputs[:, i] for i, name in enumerate(outputs)}
        departures = {
            "alpha": y["alpha"] - y["alpha"][0],
            "beta": y["beta"] - y["beta"][0],
            "bank": y["phi"],
            "pitch": y["theta"] - y["theta"][0],
            "airspeed": y["V"] / y["V"][0] - 1.0,
        }
        return np.array([np.abs(values).max() / getattr(self, name) - 1.0 for name, values in departures.items()])


@dataclass(frozen=True)
class Optimum:
    """What an optimisation found. ``cost_*`` are root mean squares of standard error over tolerance."""

    start: Prediction
    best: Prediction
    cost_start: float
    cost_best: float
    evaluations: int


def relative_error(information: Information, tolerances: Array) -> float:
    """Root mean square over the derivatives of predicted standard error over tolerance (P,)."""
    return float(np.sqrt(np.mean((information.standard_errors / tolerances) ** 2)))


def tolerances_of(predictor: Predictor) -> Array:
    """How far each derivative may be off (P,): the file's tolerance, else a tenth of its value, else one."""
    derivatives = predictor.aircraft.derivatives.values()
    return np.array([d.tolerance or 0.1 * abs(d.value) or 1.0 for d in derivatives])


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
    Raises InputError where not even the start can be flown, or nothing within the envelope is found.
    """
    search = _Search(predictor, segments, duration, envelope or Envelope(), progress)
    start = predictor.predict(draw_manoeuvre(segments, predictor.aircraft, predictor.simulator.rate, duration))
    minimize(
        search.cost,
        search.encode(segments),
        method="COBYQA",
        bounds=Bounds(np.zeros(search.size), np.ones(search.size)),
        constraints=NonlinearConstraint(search.excess, -np.inf, 0.0),
        options={"maxfev": evaluations, "initial_tr_radius": 0.15, "final_tr_radius": 1e-3},
    )
    if search.best is None:
        raise InputError(
            f"manoeuvre {start.manoeuvre.spec!r}: nothing of this form within the envelope in {search.count} trials; "
            "begin with smaller amplitudes, or allow more"
        )
    cost_start = relative_error(start.information, search.tolerances)
    return Optimum(start, search.best, cost_start, search.best_cost, search.count)


class _Search:
    """The cost and the constraints as functions of a point in the unit cube, and the best flight so far."""

    def __init__(
        self,
        predictor: Predictor,
        segments: Sequence[Segment],
        duration: float,
        envelope: Envelope,
        progress: Callable[[int, float], None] | None,
    ) -> None:
        self.predictor, self.segments, self.duration, self.envelope = predictor, segments, duration, envelope
        self.progress = progress
        self.tolerances = tolerances_of(predictor)
        self.best: Prediction | None = None
        self.best_cost = np.inf
        self.count = 0
        self._travel = _travel(predictor)
        self._last: tuple[bytes, float, Array] = (b"", _HOPELESS, np.zeros(0))
        self.size = sum(len(segment.controls) + 1 + ("width" in segment.values) for segment in segments)

    def encode(self, segments: Sequence[Segment]) -> Array:
        """The point (size,) of these segments."""
        point: list[float] = []
        for segment in segments:
            low, high = _SHARES
            for control, amplitude in zip(segment.controls, segment.amplitude, strict=True):
                point.append((abs(amplitude) / self._travel[control] - low) / (high - low))
            if "width" in segment.values:
                point.append(float(np.log(segment.values["width"] / _WIDTHS[0]) / np.log(_WIDTHS[1] / _WIDTHS[0])))
            point.append(segment.values["start"] / max(self._room(segment), 1e-9))
        return np.clip(point, 0.0, 1.0)

    def decode(self, point: Array) -> list[Segment]:
        """The segments of a point, in numbers of four digits: what is flown is what the spec says."""
        values = iter(np.clip(point, 0.0, 1.0))
        found: list[Segment] = []
        for segment in self.segments:
            low, high = _SHARES
            shares = [low + (high - low) * next(values) for _ in segment.controls]
            amplitude = tuple(
                _round(float(np.sign(a) or 1.0) * share * self._travel[c])
                for a, share, c in zip(segment.amplitude, shares, segment.controls, strict=True)
            )
            changed = dict(segment.values)
            if "width" in changed:
                changed["width"] = _round(_WIDTHS[0] * (_WIDTHS[1] / _WIDTHS[0]) ** next(values))
            moved = replace(segment, amplitude=amplitude, values=changed)
            changed["start"] = _round(next(values) * self._room(moved))
            found.append(replace(moved, values=changed))
        return found

    def cost(self, point: Array) -> float:
        """Logarithm of the relative error: its scale does not matter, and it is smoother."""
        return self._evaluate(point)[0]

    def excess(self, point: Array) -> Array:
        """The envelope's excess (5,)."""
        return self._evaluate(point)[1]

    def _room(self, segment: Segment) -> float:
        """Latest beginning (s) with which the segment still ends in time."""
        return max(self.duration - (segment.end - segment.values["start"]), 0.0)

    def _evaluate(self, point: Array) -> tuple[float, Array]:
        """Cost and excess; asked for one after the other at each point, so the last answer is kept."""
        key = np.asarray(point).tobytes()
        if key != self._last[0]:
            self._last = (key, *self._fly(point))
        return self._last[1], self._last[2]

    def _fly(self, point: Array) -> tuple[float, Array]:
        self.count += 1
        try:
            manoeuvre = draw_manoeuvre(
                self.decode(point), self.predictor.aircraft, self.predictor.simulator.rate, self.duration
            )
            prediction = self.predictor.predict(manoeuvre)
        except InputError:  # beyond the travel, or diverged: worse than any that can be flown
            return float(np.log(_HOPELESS)), np.full(5, _HOPELESS)
        cost = relative_error(prediction.information, self.tolerances)
        excess = self.envelope.excess(prediction, self.predictor.simulator.outputs)
        if excess.max() <= 0 and cost < self.best_cost:
            self.best, self.best_cost = prediction, cost
        if self.progress is not None:
            self.progress(self.count, self.best_cost)
        return float(np.log(min(cost, _HOPELESS))), excess


def _travel(predictor: Predictor) -> dict[str, float]:
    """How far each control may move from trim, either way; half a radian, or half throttle, where nothing limits it."""
    limits = control_limits(predictor.aircraft)
    trim = dict(zip(predictor.aircraft.controls, predictor.trim.command, strict=False))
    return {name: (limit - abs(trim.get(name, 0.0))) if np.isfinite(limit) else 0.5 for name, limit in limits.items()}


def _round(value: float) -> float:
    return float(f"{value:.4g}")
