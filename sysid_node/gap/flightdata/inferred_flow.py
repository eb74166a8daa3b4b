"""Flow angles of flights without vanes, as the errors of the inertial instruments and of the airspeed have them.

The angles of such a flight come from a kinematic filter (``flightdata.flow_angles``), which took the instruments for
right. An error of one of them makes the angles wrong, and a wrong angle of attack turns lift into drag. So the filter
is run again with readings that are corrected for the errors, and with the gains of its first run: these depend on the
noise and hardly on the readings.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.airflow import flow_angles
from sysid_node.dynamics.forces import lift_and_drag
from sysid_node.dynamics.rigid_body import kinematic_rates
from sysid_node.dynamics.vector import Vector
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata.flow_angles import ANGLES, STATES, FilterHistory
from sysid_node.online.alignment.flow_angle_model import FlowAngleModel, LinearForce, flow_angle_model
from sysid_node.sim.model.layout import Scalar

#: Entries of the filter's state.
_VELOCITY, _ATTITUDE, _BIASES = slice(0, 3), slice(3, 5), slice(5, STATES)


class FilterSteps(NamedTuple):
    """What the filter does at each of N samples at a constant rate, and what its references are made of."""

    interval: Scalar  # (N,) s since the sample before; zero where the filter stands still
    gains: Scalar  # (N, 8, 3), zero where it corrects nothing
    corrects: Scalar  # (N,) whether it corrects its state
    starts: Scalar  # (N, 8) the state with which it begins
    begins: Scalar  # (N,) whether it begins
    force_scale: Scalar  # (N,) coefficient of a specific force of 1 m/s^2 at an airspeed of 1 m/s
    lift: Scalar  # (N,) part of the file's lift coefficient that does not depend on alpha
    side: Scalar  # (N,) part of its side force that does not depend on beta
    slopes: Scalar  # (2,) CL_alpha and CY_beta, 1/rad
    inferred: Scalar  # (2,) whether alpha and beta are inferred


def filter_steps(
    aircraft: Aircraft, history: FilterHistory, record: FlightRecord, rate: float, length: int
) -> FilterSteps:
    """The filter's steps on the grid of a record at ``rate``, Hz, padded to ``length`` samples.

    Raises InputError where the aircraft file has no lift slope or no side-force slope.
    """
    model = flow_angle_model(aircraft)
    if model is None:
        raise InputError(f"aircraft {aircraft.name!r}: flow angles are inferred from CL_alpha and CY_beta")
    gains, starts = np.zeros((length, STATES, 3)), np.zeros((length, STATES))
    corrects, begins = np.zeros(length), np.zeros(length)
    for flags, values, marked, kept in (
        (corrects, gains, history.corrects, history.gains),
        (begins, starts, history.begins, history.states),
    ):
        places = np.rint(history.time[marked] * rate).astype(np.intp)
        within = places < len(record)
        flags[places[within]], values[places[within]] = 1.0, kept[marked][within]
    interval = np.where(np.arange(length) < len(record), 1.0 / rate, 0.0)
    missing = length - len(record)
    series = (2.0 * model.mass_over_area / record["rho"], *_known_parts(model, aircraft, record))
    scale, lift, side = (jnp.asarray(np.pad(part, (0, missing), mode="edge")) for part in series)
    slopes, inferred = np.array([model.lift.slope, model.side.slope]), np.isin(ANGLES, history.angles)
    of_filter = [jnp.asarray(part) for part in (interval, gains, corrects, starts, begins)]
    of_file = [scale, lift, side, jnp.asarray(slopes), jnp.asarray(inferred, float)]
    return FilterSteps(*of_filter, *of_file)


def inferred_velocity(
    steps: FilterSteps, force: Vector, rates: Vector, seen: Vector, bias: tuple[Scalar, Scalar]
) -> Vector:
    """The velocity (N,) at the CG relative to the air, m/s, with flow angles inferred from corrected readings.

    ``force`` (m/s^2, specific, at the CG), ``rates`` (rad/s) and ``seen``, the velocity (m/s) by the air data, are
    corrected for the instruments' errors. Its airspeed stays, and so does an angle that a vane measured. ``bias`` is
    the error of both angles (rad) that is common to all samples. Pure.
    """
    speed, *angles = flow_angles(seen, jnp)
    _, *filtered = flow_angles(_filtered(steps, force, rates, speed), jnp)
    alpha, beta = (
        jnp.where(inferred > 0.0, value - error, measured)
        for inferred, value, error, measured in zip(steps.inferred, filtered, bias, angles, strict=True)
    )
    forward = speed * jnp.cos(beta)
    return Vector(forward * jnp.cos(alpha), speed * jnp.sin(beta), forward * jnp.sin(alpha))


def _filtered(steps: FilterSteps, force: Vector, rates: Vector, speed: Scalar) -> Vector:
    """The filter's velocity (N,)."""
    imu = jnp.stack([*force, *rates], axis=1)
    before = jnp.concatenate([imu[:1], imu[:-1]])
    references = jnp.stack([speed, steps.force_scale, steps.lift, steps.side], axis=1)
    per_sample = (steps.interval, steps.gains, steps.corrects, steps.starts, steps.begins)

    def advance(carry: tuple[Scalar, Scalar], sample: tuple[Scalar, ...]) -> tuple[tuple[Scalar, Scalar], Scalar]:
        (state, sums), (last, now, reference, interval, gain, corrects, start, begins) = carry, sample
        state = _integrated(state, interval, last, now)
        sums = sums + jnp.append(_innovations(state, now, reference, steps.slopes), 1.0)
        state = state + gain @ (sums[:3] / sums[3])
        state = jnp.where(begins > 0.0, start, state)
        return (state, jnp.where(corrects + begins > 0.0, jnp.zeros(4), sums)), state[_VELOCITY]

    first = (steps.starts[0], jnp.zeros(4))
    _, velocity = jax.lax.scan(advance, first, (before, imu, references, *per_sample))
    u, v, w = velocity.T
    return Vector(u, v, w)


def _integrated(state: Scalar, interval: Scalar, last: Scalar, now: Scalar) -> Scalar:
    """The state (8,) one sample later, by Heun's rule between two readings (6,) of specific force and rates."""

    def rate(at: Scalar, reading: Scalar) -> Scalar:
        (roll, pitch), (p, q, az) = at[_ATTITUDE], at[_BIASES]
        force = Vector(reading[0], reading[1], reading[2] - az)
        rates = Vector(reading[3] - p, reading[4] - q, reading[5])
        attitude = Vector(roll, pitch, jnp.zeros(()))
        velocity, turning = kinematic_rates(Vector(*at[_VELOCITY]), attitude, force, rates, jnp)
        return jnp.stack([*velocity, turning.x, turning.y, *jnp.zeros(3)])

    first = rate(state, last)
    second = rate(state + interval * first, now)
    return state + 0.5 * interval * (first + second)


def _innovations(state: Scalar, reading: Scalar, reference: Scalar, slopes: Scalar) -> Scalar:
    """Airspeed (m/s), alpha and beta (rad) of the references less the filter's, (3,)."""
    speed, scale, lift, side = reference
    own, alpha, beta = flow_angles(Vector(*state[_VELOCITY]), jnp)
    scale = scale / speed**2
    lifting, _ = lift_and_drag(reading[0], reading[2] - state[_BIASES][2], jnp.cos(alpha), jnp.sin(alpha))
    angles = (scale * lifting - lift) / slopes[0], (scale * reading[1] - side) / slopes[1]
    return jnp.stack([speed - own, angles[0] - alpha, angles[1] - beta])


def _known_parts(model: FlowAngleModel, aircraft: Aircraft, record: FlightRecord) -> tuple[Array, Array]:
    """Parts (N,) of the file's lift and side force that depend on neither angle."""
    speed = record["V"]
    rates = [record["p"] * model.half_span, record["q"] * model.half_chord, record["r"] * model.half_span]
    controls = [record[symbol] for symbol in aircraft.control_symbols]
    regressors = [*(rate / speed for rate in rates), speed / model.airspeed, *controls]

    def of(force: LinearForce) -> Array:
        return np.asarray(force.offset + sum(value * regressors[i] for i, value in force.others))

    return of(model.lift), np.asarray(of(model.side) * np.ones_like(speed))
