"""Readings of short simulated flights beside the measured ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import LONGITUDINAL_SIGNALS
from sysid_node.flight.record import Array
from sysid_node.gap.estimation.predictive_density import FlightEvidence, window_groups
from sysid_node.gap.flightdata import thrust
from sysid_node.gap.flightdata.time_scales import short_flight
from sysid_node.gap.residuals.excited_axes import excited_motions, of_motions
from sysid_node.gap.residuals.flight_path_reconstruction import motion_of
from sysid_node.gap.residuals.prediction_cache import cache_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.short_flights.multiple_shooting import Course, course_of, simulate_beside, simulation_error
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim.model.layout import OUTPUTS

#: Readings that are compared. Heading is left out, because it is the integral of the yaw rate.
READINGS = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "V", "alpha", "beta")

#: Mean square of the error of a simulator that diverges.
DIVERGED = 1e300

_COLUMNS = tuple(OUTPUTS.index(name) for name in READINGS)

#: The sensor of each reading, by its name in the aircraft file.
_SENSOR_OF = {
    **dict.fromkeys(("ax", "ay", "az"), "accel"),
    **dict.fromkeys("pqr", "gyro"),
    **dict.fromkeys(("phi", "theta"), "attitude"),
    "V": "airspeed",
    "alpha": "alpha",
    "beta": "beta",
}


def can_be_simulated(model: ResidualModel) -> bool:
    """Whether short flights can be simulated: attitude was measured, and the flight is long enough."""
    return motion_of(model.record) is not None and len(model.record) >= size_of(model)


def size_of(model: ResidualModel) -> int:
    """Samples of a short flight."""
    return round(length_of(model) * model.simulator.rate)


def length_of(model: ResidualModel) -> float:
    """Length of a short flight, s."""
    return round(short_flight(model.simulator.aircraft), 1)


def course_of_flight(model: ResidualModel) -> Course:
    """The course of a flight that is simulated in short flights."""
    return course_of(model, size_of(model))


def by_short_flight(model: ResidualModel, series: Array) -> Array:
    """A series (N, 12) of readings by short flight (S, samples, R)."""
    size = size_of(model)
    count = len(series) // size
    return np.asarray(series[: count * size, _COLUMNS].reshape(count, size, len(_COLUMNS)))


def squares(model: ResidualModel, series: Array) -> Array:
    """Mean squares (S, R) of a series (N, 12) by short flight."""
    return np.asarray((by_short_flight(model, series) ** 2).mean(axis=1))


def motion(model: ResidualModel, measured: Array) -> Array:
    """Mean squares (S, R) of measured readings (N, 12) about their means in each short flight."""
    parts = by_short_flight(model, measured)
    return np.asarray(((parts - parts.mean(axis=1, keepdims=True)) ** 2).mean(axis=1))


def compared(models: Sequence[ResidualModel]) -> NDArray[np.bool_]:
    """Which readings (R,) were measured in all flights, of a motion that the commands excite."""
    flights = [model.flight for model in models]
    lateral = all(flight.lateral for flight in flights)
    unread = {angle for flight in flights for angle in flight.inferred}
    unread |= thrust.THRUST_READINGS if any(not flight.metered for flight in flights) else set()
    known = np.array([(lateral or name in LONGITUDINAL_SIGNALS) and name not in unread for name in READINGS])
    return np.asarray(known & of_motions(READINGS, excited_motions(models)))


def noise_power(noise: Mapping[str, float]) -> Array:
    """Variance (R,) of a sample of each reading from 1 sigma of the sensors (SI, by the aircraft file's names)."""
    return np.array([noise[_SENSOR_OF[name]] for name in READINGS]) ** 2


def errors_by_group(model: ResidualModel, points: Sequence[Array], course: Course) -> Array:
    """Measured minus simulated (N, 12), each short flight with the parameters (P,) of its group of windows."""
    size, windows = size_of(model), model.windows
    edges = [windows.slices[group[0]].start + windows.size / 4 for group in window_groups(model)][1:]
    middles = np.arange(len(model.record)) // size * size + size // 2
    group_of = np.searchsorted(np.array(edges), middles, side="right")
    error = np.empty((len(model.record), len(OUTPUTS)))
    for groups, theta in _distinct(points):
        chosen = np.isin(group_of, groups)
        error[chosen] = simulation_error(model, theta, course)[chosen]
    return error


def _distinct(points: Sequence[Array]) -> list[tuple[list[int], Array]]:
    """Distinct parameters (P,), each with the indices of the groups that have them."""
    places: dict[bytes, list[int]] = {}
    for place, point in enumerate(points):
        places.setdefault(np.ascontiguousarray(point).tobytes(), []).append(place)
    return [(groups, points[groups[0]]) for groups in places.values()]


def reading_motion(models: Sequence[ResidualModel]) -> Array:
    """Mean squares (R,) of the motion of all flights by reading; infinite where a reading is not compared.

    That is where it was not measured, hardly rises above the sensors' noise, or belongs to a motion that no command
    excites.
    """
    flown = [model for model in models if can_be_simulated(model)]
    if not flown:
        return np.full(len(READINGS), np.inf)
    measured = [simulate_beside(model, model.simulator.neutral(), course_of_flight(model))[1] for model in flown]
    power = np.concatenate([motion(model, m) for model, m in zip(flown, measured, strict=True)]).mean(axis=0)
    counted = compared(models) & (power > THRESHOLDS.validation.motion * noise_power(flown[0].simulator.aircraft.noise))
    return np.where(counted, power, np.inf)


def _squared_errors(flight: FlightEvidence) -> Array:
    """Mean squares (S, R) of the errors of one flight's short flights; what was computed before is kept."""
    model, points = flight.model, flight.points
    kept, key = cache_of(model).short_flights, b"".join(point.tobytes() for point in points)
    known = kept.get(key)
    return (
        kept.keep(key, squares(model, errors_by_group(model, points, course_of_flight(model))))
        if known is None
        else known
    )


def reading_errors(flights: Sequence[FlightEvidence]) -> Array:
    """Mean squares (R,) of the errors of short flights with the parameters of each flight's evidence.

    ``DIVERGED`` where the simulator diverges, zero where no flight can be simulated.
    """
    found = [_squared_errors(flight) for flight in flights if can_be_simulated(flight.model)]
    if not found:
        return np.zeros(len(READINGS))
    mean = np.concatenate(found).mean(axis=0)
    return np.where(np.isfinite(mean), mean, DIVERGED)
