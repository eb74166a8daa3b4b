"""The noise floor of short simulated flights, by simulation: the error of a simulator with nothing wrong.

The simulator itself takes the place of the aircraft. It flies the flight's commands, short flight by short flight, in
air that moves as the air data show and rotates as turbulence of that strength does (``sim.signals.dryden``), and the
sensors' noise is added to its readings. Simulated beside this record, the same simulator has the error that no model
can avoid: noise in the readings, in the initial states and in the motion of the air, and the air's rotation, which no
vane measures. Without vanes the air's motion across the flight path is not measured either.
"""

from __future__ import annotations

from collections.abc import Iterator

import jax.numpy as jnp
import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.flightdata.gap_flight import resampled
from sysid_node.gap.residuals.flight_path_reconstruction import InstrumentReadings
from sysid_node.gap.residuals.predictions import kinematic_parameters
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.residuals.sensor_noise import with_added_noise
from sysid_node.gap.short_flights.multiple_shooting import Course, simulate_beside, simulation_error
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim.model.layout import OUTPUTS
from sysid_node.sim.signals.dryden import Dryden

#: Flights that are simulated.
_REALISATIONS = 6

#: Turbulence is drawn for a multiple of so many samples: its realisation does not depend on how a course is padded.
_BLOCK = 500

#: Height above ground of the turbulence model, m. The result depends little on it.
_HEIGHT = 100.0

#: Clock errors that are neutral here: simulated readings are at the time of the motion.
_CLOCKS = ("imu_delay.delay", "air_data_delay.delay")


def noise_floor_errors(
    model: ResidualModel, theta: Array, course: Course, seed: int = 0
) -> Iterator[tuple[Array, Array]]:
    """For each of a few simulated flights of parameters (P,): its errors (N, 12), and the noise (N, 12) added to it."""
    random, prompt = np.random.default_rng(seed), theta.copy()
    prompt[[model.simulator.names.index(name) for name in _CLOCKS]] = 0.0
    shown = _air_shown(model, theta, course)
    for _ in range(_REALISATIONS):
        again = resampled(with_added_noise(model.simulator.aircraft, model.flight, random), model.simulator.rate)
        added = {n: values - model.record[n] for n, values in again.columns.items()}
        noise = np.column_stack([added.get(name, np.zeros(len(model.record))) for name in OUTPUTS])
        moving, turning = _unmeasured_air(model, course, shown, noise, random)
        air = course._replace(moving=jnp.asarray(moving), turning=jnp.asarray(turning))
        readings, _, _ = simulate_beside(model, prompt, air)
        readings = readings - _flow_angles_of(model, moving) + noise
        yield simulation_error(model, prompt, _recorded(model, course, readings, added)), noise


def _air_shown(model: ResidualModel, theta: Array, course: Course) -> Array:
    """Velocity (N, 3) of the air, m/s, within the short flights, as the air data show it at parameters (P,).

    A vane off its place or a gyro's bias looks like moving air. Where most of the motion goes away with other
    parameters of the instruments, it is theirs and no weather, whatever the explanation holds.
    """
    _, _, shown = simulate_beside(model, theta, course)
    if model.instruments is None:
        return shown
    corrected, kinematic = theta.copy(), kinematic_parameters(model.simulator.layout)
    corrected[kinematic] = model.instruments[kinematic]
    _, _, calmer = simulate_beside(model, corrected, course)
    return calmer if _power(calmer) < THRESHOLDS.validation.instruments * _power(shown) else shown


def _unmeasured_air(
    model: ResidualModel, course: Course, shown: Array, noise: Array, random: np.random.Generator
) -> tuple[Array, Array]:
    """Velocity (m/s) and rotation (rad/s) of the air, (N, 3) each along body axes, that the air data do not show.

    A realisation of turbulence, as strong as the motion that the air data show within the short flights (N, 3), less
    what the air data's noise (N, 12) adds to it.
    """
    dryden, speed = Dryden.at(_HEIGHT, model.simulator.aircraft.geometry.b), float(model.record["V"].mean())
    drawn = -(-len(model.record) // _BLOCK) * _BLOCK
    gusts = dryden.realisation(drawn, model.simulator.rate, speed, random)
    begins = np.asarray(course.begins)[:drawn]
    origin = np.maximum.accumulate(np.where(begins, np.arange(begins.size), 0))
    seen = slice(0, 1) if model.flight.inferred else slice(1, 3)
    usual = _power((gusts - gusts[origin])[:, seen])
    read = noise[:, [OUTPUTS.index(name) for name in ("V", "beta", "alpha")]] * [1.0, speed, speed]
    moved = max(_power(shown[:, seen]) - _power((read - read[origin[: len(read)]])[:, seen]), 0.0)
    gusts *= np.sqrt(moved / usual)
    across = [float(name in model.flight.inferred) for name in ("V", "beta", "alpha")]
    padded = np.pad(gusts, ((0, course.altitude.size - drawn), (0, 0)), mode="edge")
    return padded[:, :3] * across, padded[:, 3:]


def _flow_angles_of(model: ResidualModel, moving: Array) -> Array:
    """Changes of the readings (N, 12) of the flow angles by air that moves at (N, 3) m/s and that no vane measures."""
    angles = np.zeros((len(model.record), len(OUTPUTS)))
    angles[:, [OUTPUTS.index("beta"), OUTPUTS.index("alpha")]] = -moving[: len(angles), 1:] / model.record["V"][:, None]
    return angles


def _power(velocity: Array) -> float:
    """Mean square (m^2/s^2) of a velocity (N, K)."""
    return float((velocity**2).sum(axis=1).mean())


def _recorded(model: ResidualModel, course: Course, readings: Array, noise: dict[str, Array]) -> Course:
    """The course with simulated readings (N, 12) as measured, and with the noise of the commands."""
    turning = _rates_of_change(readings[:, 3:6], np.asarray(course.begins), model.simulator.step)
    symbols = [*model.simulator.layout.symbols, *(["thrust"] if model.simulator.aircraft.throttle else [])]
    commands = np.asarray(course.commands).copy()
    unfiltered, added = np.asarray(course.unfiltered).copy(), np.column_stack([noise[s] for s in symbols])
    commands[: len(readings), : len(symbols)] += added
    unfiltered[: len(readings)] += added[:, None, : unfiltered.shape[2]]
    short = course.altitude.size - len(readings)
    parts = [*np.split(readings, (3, 6, 9), axis=1), turning]
    force, rates, attitude, air, turned = (jnp.pad(jnp.asarray(p), ((0, short), (0, 0)), mode="edge") for p in parts)
    return course._replace(
        motion=InstrumentReadings(force, rates, turned, air, attitude),
        commands=jnp.asarray(commands),
        unfiltered=jnp.asarray(unfiltered),
    )


def _rates_of_change(rates: Array, begins: Array, step: float) -> Array:
    """Derivatives with time (N, 3) of angular rates (N, 3) that jump where short flights begin."""
    starts = np.flatnonzero(begins[: len(rates)])
    pieces = [p for p in np.split(rates, starts[1:]) if len(p)]
    return np.concatenate([np.gradient(p, step, axis=0) if len(p) > 1 else np.zeros_like(p) for p in pieces])
