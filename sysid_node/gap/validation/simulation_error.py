"""The gap in the time domain: errors of short simulated flights, beside their noise floor.

The error of a reading is the root mean square of simulated minus measured, over the root mean square of the measured
motion about its mean in each short flight. The overall error is the root mean square over the readings that moved. The
noise floor is the error of a simulator with nothing wrong (``noise_floor``). Intervals are by a block bootstrap over
the short flights (Kuensch (1989), Annals of Statistics 17(3)).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.predictive_density import Evidence, window_groups
from sysid_node.gap.residuals.excited_axes import excited_motions, of_motions
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.short_flights.multiple_shooting import Course, simulate_beside, simulation_error
from sysid_node.gap.short_flights.readings import (
    READINGS,
    can_be_simulated,
    compared,
    course_of_flight,
    errors_by_group,
    motion,
    noise_power,
    squares,
)
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.gap.validation.noise_floor import noise_floor_errors
from sysid_node.gap.validation.spectral_error import STAGES, Gap, gap_from
from sysid_node.gap.validation.standing import weather_accounts_for

#: Bootstrap draws, and length of a block in short flights.
_DRAWS, _BLOCK = 2000, 2


@dataclass(frozen=True)
class SideBySide:
    """A flight and its simulation, N samples: readings (N, 12) as measured, by the file and as corrected.

    Columns are ``sim.model.layout.OUTPUTS``; ``begins`` (N,) marks where short flights begin.
    """

    time: Array  # s since the recording began
    measured: Array
    before: Array
    after: Array
    begins: NDArray[np.bool_]


def simulation_gap(base: Evidence, final: Evidence) -> Gap | None:
    """The gap of short simulated flights, on the flights of evidence without and with the causes.

    None without attitude, where no flight is long enough, where the simulator diverges within a short flight, or where
    no reading moved.
    """
    pairs = list(zip(base.flights, final.flights, strict=True))
    simulated = [pair for pair in pairs if can_be_simulated(pair[0].model)]
    tables = [_table(before.model, before.points, after.points) for before, after in simulated]
    return gap_of_errors([evidence.model for evidence in final.flights], tables)


def gap_of_errors(models: Sequence[ResidualModel], tables: Sequence[Array]) -> Gap | None:
    """The gap from each flight's mean squares (5 + K, S, R) by short flight and reading.

    They are those of the motion, of the sensors' noise, of the errors by the file, with the fitted derivatives and with
    the causes, and of the errors of K flights for the noise floor. None as for ``simulation_gap``.
    """
    if not tables or not all(np.isfinite(table).all() for table in tables):
        return None
    moving, noise, *errors = np.concatenate(tables, axis=1)
    counted = compared(models)
    counted &= moving.mean(axis=0) > THRESHOLDS.validation.motion * noise.mean(axis=0)
    if not counted.any():
        return None
    return _summary(moving[:, counted], np.array(errors)[:, :, counted], np.array(READINGS)[counted].tolist())


def weather_suffices(models: Sequence[ResidualModel]) -> bool:
    """Whether weather and the sensors' noise account for the error of the file's own simulator in every reading.

    Then no effect is a cause, however well it imitates the weather. They must do so in all flights together, and in
    each: a flight in gusts hides what a calm one shows.
    """
    tables = [_table(v, *[[v.simulator.neutral()] * len(window_groups(v))] * 2) for v in models if can_be_simulated(v)]
    if not tables or not all(np.isfinite(table).all() for table in tables):
        return False
    excited = of_motions(READINGS, excited_motions(models))
    return all(_is_weather(table[..., excited]) for table in (np.concatenate(tables, axis=1), *tables))


def _is_weather(table: Array) -> bool:
    """Whether weather accounts for the error by the file in mean squares as for ``gap_of_errors``."""
    _, _, before, _, _, *floors = table.mean(axis=1)
    return weather_accounts_for(before, np.array(floors))


def error_shares(models: Sequence[ResidualModel], noise: Mapping[str, float]) -> dict[str, float]:
    """The file's simulator's error of each reading that moved, as a share of the motion, on short flights.

    ``noise`` is 1 sigma of the sensors (SI, by the names of the aircraft file) that the motion must exceed to count.
    Empty where no short flight can be simulated, or where the simulator diverges.
    """
    motions, errors = [np.empty((0, len(READINGS)))], [np.empty((0, len(READINGS)))]
    for model in filter(can_be_simulated, models):
        course, neutral = course_of_flight(model), model.simulator.neutral()
        motions.append(motion(model, simulate_beside(model, neutral, course)[1]))
        errors.append(squares(model, simulation_error(model, neutral, course)))
    moving, error = (np.concatenate(parts) for parts in (motions, errors))
    if not len(moving) or not np.isfinite(error).all():
        return {}
    least = THRESHOLDS.validation.motion * noise_power(noise)
    shares = np.sqrt(error.mean(axis=0) / np.maximum(moving.mean(axis=0), 1e-300))
    moved = moving.mean(axis=0) > least
    return {name: float(share) for name, share, counts in zip(READINGS, shares, moved, strict=True) if counts}


def side_by_side(model: ResidualModel, points: Sequence[Array]) -> SideBySide:
    """A flight with its simulation by the file and as corrected; ``points`` are parameters (P,) by group of windows."""
    course, neutral = course_of_flight(model), model.simulator.neutral()
    _, measured, _ = simulate_beside(model, neutral, course)
    before, after = (
        measured - e for e in (simulation_error(model, neutral, course), errors_by_group(model, points, course))
    )
    return SideBySide(model.time, measured, before, after, np.asarray(course.begins)[: len(measured)])


def _summary(motion: Array, errors: Array, names: list[str]) -> Gap:
    """The gap from mean squares of motion (S, R) and errors (3 + K, S, R) by short flight and reading.

    The last K errors are those of as many flights for the noise floor. Each bootstrap draw uses another one of them.
    """
    whole = _shares(motion, np.concatenate([errors[:3], errors[3:].mean(axis=0, keepdims=True)]))
    random = np.random.default_rng(0)
    overall, draws = _overall(whole), list[Array]()
    centred = np.append(np.ones(3), _floored(overall)[3] / overall[3])  # draws scatter about the stated value
    for windows in _blocks(len(motion), random):
        taken = errors[[0, 1, 2, int(random.integers(3, len(errors)))]]
        draws.append(_floored(centred * _overall(_shares(motion[windows], taken[:, windows]))))
    by_reading = {name: dict(zip(STAGES, _floored(whole[:, r]).tolist(), strict=True)) for r, name in enumerate(names)}
    return gap_from(_floored(overall), np.array(draws), by_reading)


def _floored(errors: Array) -> Array:
    """Errors (4,) whose last, the noise floor, is at most the smallest of the others."""
    return np.append(errors[:3], errors.min())


def _shares(motion: Array, errors: Array) -> Array:
    """Errors (4, R) as shares of the motion."""
    return np.asarray(np.sqrt(errors.mean(axis=1) / motion.mean(axis=0)))


def _overall(shares: Array) -> Array:
    """Root mean square over the readings (..., R)."""
    return np.asarray(np.sqrt((shares**2).mean(axis=-1)))


def _blocks(count: int, random: np.random.Generator) -> NDArray[np.intp]:
    """Indices (D, count) of short flights in blocks; the last short flight is followed by the first."""
    size = min(_BLOCK, count)
    starts = random.integers(count, size=(_DRAWS, -(-count // size)))
    return np.asarray((starts[..., None] + np.arange(size)).reshape(_DRAWS, -1)[:, :count] % count)


def _table(model: ResidualModel, base: Sequence[Array], final: Sequence[Array]) -> Array:
    """Mean squares as for ``gap_of_errors``, by parameters (P,) of each group of windows without and with causes."""
    course, neutral = course_of_flight(model), model.simulator.neutral()
    measured = simulate_beside(model, neutral, course)[1]
    errors = [errors_by_group(model, points, course) for points in ([neutral] * len(base), base, final)]
    return mean_squares(model, final[len(final) // 2], course, measured, errors)


def mean_squares(model: ResidualModel, theta: Array, course: Course, measured: Array, errors: Sequence[Array]) -> Array:
    """Mean squares as for ``gap_of_errors`` of measured readings (N, 12) and three errors (N, 12).

    The noise floor is that of parameters (P,).
    """
    floors, noise = zip(*noise_floor_errors(model, theta, course), strict=True)
    moving = motion(model, measured)
    sensors = np.mean([squares(model, each) for each in noise], axis=0)
    powers = [squares(model, error) for error in errors]
    unknown = np.array([model.reading_errors.get(name, 0.0) for name in READINGS]) ** 2 * moving
    return np.stack([moving, sensors, *powers, *(squares(model, floor) + unknown for floor in floors)])
