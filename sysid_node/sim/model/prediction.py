"""The chain on measured signals: the accelerations that the aircraft should have shown, given what it measured.

Where a rollout integrates the motion, this takes it from the instruments, so that turbulence and drift do no harm: the
same stations turn recorded commands and measured flow and rates into forces and moments, and those into the readings
of accelerometers and the rates of the gyroscopes' readings. Sensor effects are undone on what goes in and applied to
what comes out. What has a memory of its own (actuators, motor, separation, structure) is carried along the record.

``predict`` gives accelerations; ``coefficients`` reduces accelerations, predicted or measured, to the six coefficients
by the aircraft file (Klein & Morelli (2006), "Aircraft System Identification", ch. 5).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from sysid_node.dynamics.airflow import flow_angles, stability_axes, velocity_of
from sysid_node.dynamics.atmosphere import dynamic_pressure
from sysid_node.dynamics.attitude import quaternion, to_earth
from sysid_node.dynamics.coefficients import Coefficients
from sysid_node.dynamics.forces import coefficients_of, thrust_axes
from sysid_node.dynamics.lever_arm import specific_force_at, specific_force_from, velocity_from
from sysid_node.dynamics.rigid_body import accelerations, moment_for
from sysid_node.dynamics.vector import Vector
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.sim.effects import actuator_backlash, actuator_lag, actuator_rate_limit, stall_separation
from sysid_node.sim.effects.actuator_lag import first_order
from sysid_node.sim.model.chain import Chain, drive_of, steady_load, unsteady_load
from sysid_node.sim.model.layout import Layout, Model, Scalar
from sysid_node.sim.model.parameters import Parameters, table
from sysid_node.sim.signals.time_shift import shift_cubic, slope
from sysid_node.sim.simulator import Simulator
from sysid_node.sim.stations import command, mass, propulsion, sensors, structure
from sysid_node.sim.stations.airflow import Air

Array = NDArray[np.float64]

_Result = TypeVar("_Result")

#: Whether an effect does something; None: not known.
_Acts = Callable[[str], Scalar | None]

#: What ``coefficients`` gives, in this order.
COEFFICIENTS = Coefficients._fields


class Signals(NamedTuple):
    """A flight as it was measured, N samples at a constant rate, by the messages' stamps."""

    rates: Scalar  # (N, 3) rad/s
    air: Scalar  # (N, 3) V m/s, alpha, beta rad, at the probe
    density: Scalar  # (N,) kg/m^3
    commands: Scalar  # (N, controls + 1) rad, thrust N, as recorded
    climb: Scalar  # (N,) m since the start
    velocity: Vector | None = None  # (N,) m/s relative to the air at the CG when it moved, where better known
    alpha_rate: Scalar | None = None  # (N,) rad/s, the same


class Accelerations(NamedTuple):
    """What the inertial instruments show, N samples: columns apart, for XLA would work each out for all of a table."""

    force: Vector  # (N,) readings of the accelerometers, m/s^2
    turning: Vector  # (N,) rates of the gyroscopes' readings, rad/s^2


class _Memory(NamedTuple):
    """What commands and flow leave behind, whatever forces come of it."""

    actuators: Scalar  # (N, controls) rad
    motor: Scalar  # (N,) N
    separation: Scalar  # (N,) attached fraction of the flow


class _Shaken(NamedTuple):
    """The motion (N,) of an airframe that rings."""

    rates: Vector  # rad/s, the body's alone
    force: Vector  # specific, at the CG, m/s^2
    acceleration: Vector  # rad/s^2
    mode: Scalar  # (N, 2) displacement m and speed m/s


class _Sample(NamedTuple):
    """One sample of what is known without a memory."""

    command: Scalar
    velocity: Vector  # at the CG, relative to the air
    rates: Vector
    density: Scalar
    climb: Scalar
    alpha_rate: Scalar
    time: Scalar


def predict(
    layout: Layout, model: Model, theta: Parameters, signals: Signals, step: Scalar, acting: Scalar | None = None
) -> Accelerations:
    """What parameters (P,) expect the instruments to show, given these signals; pure.

    Only what remembers is carried along, sample by sample; forces and moments of all samples are worked out at once.
    ``acting`` (P,): which parameters are not neutral or will be differentiated; what none of these needs is left out.
    """
    chain = Chain.of(layout, model, theta, step, jnp.zeros(()))
    samples = _true_motion(chain, signals)
    acts = partial(_acts, layout, acting)
    memory = _Memory(
        _actuators(chain, samples.command[:, :-1], acts),
        _motor(chain, samples.command[:, -1], acts),
        _either(acts("stall_separation"), lambda: _separation(chain, samples), lambda: jnp.ones_like(samples.time)),
    )
    force, acceleration = _accelerations(chain, memory, samples)
    still = _Shaken(samples.rates, force, acceleration, jnp.zeros((*force.z.shape, 2)))
    shaken = _either(acts("structural_mode"), lambda: _shaken(chain, memory, samples, force), lambda: still)
    readings = _readings(chain, *shaken)
    late = chain.effects["imu_delay"]["delay"] / step
    delayed: Accelerations = jax.tree.map(lambda series: shift_cubic(series, late), readings)
    return delayed


def coefficients(model: Model, signals: Signals, accelerations: Accelerations) -> Coefficients:
    """Coefficients (N,) about the file's CG that the instruments show, by the aircraft file alone."""
    rates, turning = Vector(*signals.rates.T), accelerations.turning
    imu, probe = Vector(*model.imu), Vector(*model.air_data)
    specific_force = specific_force_from(accelerations.force, rates, turning, imu)
    velocity = velocity_from(velocity_of(signals.air.T, jnp), rates, probe)
    speed, _, _ = flow_angles(velocity, jnp)
    thrust = propulsion.commanded(model, signals.commands[:, -1])
    forward, down = thrust_axes(model.thrust_inclination, jnp)
    pull = Vector(thrust * forward, jnp.zeros_like(thrust), thrust * down)
    force = specific_force.times(model.mass).minus(pull)
    moment = moment_for(mass.nominal(model), rates, turning)
    moment = moment._replace(y=moment.y - model.thrust_arm * thrust)
    pressure_area = dynamic_pressure(signals.density, speed) * model.area
    return coefficients_of(force, moment, stability_axes(velocity, jnp), pressure_area, model.span, model.chord)


def signals_of(simulator: Simulator, record: FlightRecord) -> Signals:
    """A record's signals on the simulator's regular time base, by cubic (commands: linear) interpolation.

    Raises InputError where rates, airspeed, flow angles, density, a control or the thrust of an aircraft with an
    engine is missing.
    """
    thrust = () if simulator.aircraft.throttle is None else ("thrust",)
    needed = ("p", "q", "r", "V", "alpha", "beta", "rho", *simulator.layout.symbols, *thrust)
    missing = [name for name in needed if not np.isfinite(record[name]).all()]
    if missing:
        raise InputError(
            f"flight {record.name!r}: no complete {', '.join(missing)}; forces cannot be predicted without"
        )
    time = record.time[0] + np.arange(int(record.duration * simulator.rate + 1e-9) + 1) * simulator.step
    smooth = {name: CubicSpline(record.time, record[name])(time) for name in needed[:7]}
    commands = [np.interp(time, record.time, record[name]) for name in (*simulator.layout.symbols, *thrust)]
    if not thrust:
        commands.append(np.zeros_like(time))
    return Signals(
        rates=jnp.asarray(np.column_stack([smooth["p"], smooth["q"], smooth["r"]])),
        air=jnp.asarray(np.column_stack([smooth["V"], smooth["alpha"], smooth["beta"]])),
        density=jnp.asarray(smooth["rho"]),
        commands=jnp.asarray(np.column_stack(commands)),
        climb=jnp.asarray(_climb(record, time)),
    )


def _climb(record: FlightRecord, time: Array) -> Array:
    """Height gained through the air since the start (m) by attitude, airspeed and flow angles; 0 without attitude."""
    if not (np.isfinite(record["theta"]).all() and np.isfinite(record["phi"]).all()):
        return np.zeros_like(time)
    speed = np.asarray(_speed_of_climb(*(record[name] for name in ("phi", "theta", "V", "alpha", "beta"))))
    gained: Array = cumulative_trapezoid(speed, np.asarray(record.time), initial=0)
    return np.asarray(np.interp(time, record.time, gained))


@jax.jit
def _speed_of_climb(roll: Scalar, pitch: Scalar, airspeed: Scalar, alpha: Scalar, beta: Scalar) -> Scalar:
    """Speed (N,) upwards through the air, m/s."""
    attitude = quaternion((roll, pitch, jnp.zeros_like(roll)), jnp)
    climb: Scalar = -to_earth(attitude, Vector(*velocity_of((airspeed, alpha, beta), jnp))).z
    return climb


def _acts(layout: Layout, acting: Scalar | None, effect: str) -> Scalar | None:
    """Whether an effect does something; None: not known."""
    if acting is None:
        return None
    return acting[np.array([i for i, (name, p) in enumerate(table(layout)) if name == effect and p.switch])].any()


def _either(condition: Scalar | None, this: Callable[[], _Result], other: Callable[[], _Result]) -> _Result:
    """The one or the other; without a condition, this."""
    result: _Result = this() if condition is None else jax.lax.cond(condition, this, other)
    return result


def _true_motion(chain: Chain, signals: Signals) -> _Sample:
    """What the sensors' effects hide: the motion and flow at the times of the samples."""
    effects, step = chain.effects, chain.step
    late_imu, late_air = effects["imu_delay"]["delay"], effects["air_data_delay"]["delay"]
    rates = sensors.rates_from(effects, Vector(*shift_cubic(signals.rates, -late_imu / step).T))
    velocity = signals.velocity
    if velocity is None:
        reading = jnp.stack(sensors.flow_from(effects, *shift_cubic(signals.air, -late_air / step).T), 1)
        flow = sensors.before_lag(effects, reading, None, step)
        arm = sensors.air_data_arm(chain.model, effects, chain.body)
        velocity = Vector(*velocity_from(velocity_of(flow.T, jnp), rates, arm))
    _, alpha, _ = flow_angles(velocity, jnp)
    return _Sample(
        command=command.arrive(effects, signals.commands, step),
        velocity=velocity,
        rates=rates,
        density=signals.density,
        climb=signals.climb,
        alpha_rate=slope(alpha, step) if signals.alpha_rate is None else signals.alpha_rate,
        time=jnp.arange(signals.density.shape[0]) * step,
    )


def _flow(sample: _Sample) -> Air:
    speed, alpha, beta = flow_angles(sample.velocity, jnp)
    return Air(sample.velocity, sample.rates, speed, alpha, beta, sample.density)


def _actuators(chain: Chain, commands: Scalar, acts: _Acts) -> Scalar:
    """Where the actuators stand at each sample (N, controls) of their commands, at rest on the first.

    Stage by stage, as ``actuator.advance`` has them.
    """
    effects, h, controls = chain.effects, chain.step, chain.layout.controls

    def linked(x: Scalar, u: Scalar) -> Scalar:
        play = effects["actuator_backlash"]
        return jnp.stack([actuator_backlash.advance(play, name, x[i], u[i]) for i, name in enumerate(controls)])

    limited = jnp.clip(commands, -chain.model.limits, chain.model.limits)
    lag, rate = (partial(e.advance, effects[e.EFFECT.name]) for e in (actuator_lag, actuator_rate_limit))
    position = _lagged(acts("actuator_lag"), lambda x, before, now: lag(x, before, now, h), limited)
    position = _carried(acts("actuator_backlash"), linked, position)
    return _carried(acts("actuator_rate_limit"), lambda x, u: rate(x, u, h), position)


def _motor(chain: Chain, commands: Scalar, acts: _Acts) -> Scalar:
    """The motor's thrust (N,) at each sample of its commands."""
    able = propulsion.commanded(chain.model, commands)
    advance = partial(propulsion.advance, chain.effects, step=chain.step)
    return _lagged(acts("motor_lag"), advance, able)


def _carried(acts: Scalar | None, advance: Callable[[Scalar, Scalar], Scalar], series: Scalar) -> Scalar:
    """What remembers where it was, at each sample of a series (N, ...) that moves it; the series, if it does not."""

    def step(last: Scalar, now: Scalar) -> tuple[Scalar, Scalar]:
        there = advance(last, now)
        return there, there

    return _either(acts, lambda: jax.lax.scan(step, series[0], series)[1], lambda: series)


def _lagged(acts: Scalar | None, advance: Callable[[Scalar, Scalar, Scalar], Scalar], series: Scalar) -> Scalar:
    """The same of what also remembers what moved it."""

    def step(last: tuple[Scalar, Scalar], now: Scalar) -> tuple[tuple[Scalar, Scalar], Scalar]:
        there = advance(*last, now)
        return (there, now), there

    return _either(acts, lambda: jax.lax.scan(step, (series[0], series[0]), series)[1], lambda: series)


def _separation(chain: Chain, samples: _Sample) -> Scalar:
    """Attached fraction of the flow at each sample (N,), settled on the first."""
    air, values = _flow(samples), chain.effects["stall_separation"]
    time_scale = chain.model.chord / air.speed
    attached = stall_separation.attached(values, air.alpha, samples.alpha_rate, time_scale)
    start = stall_separation.attached(values, air.alpha[0], jnp.zeros(()), jnp.zeros(()))

    def advance(last: Scalar, sample: Scalar) -> tuple[Scalar, Scalar]:
        now = first_order(sample[0], last, sample[1], sample[2], chain.step)
        return now, now

    before = jnp.concatenate([start[None], attached[:-1]])
    _, separation = jax.lax.scan(advance, start, jnp.stack([values["tau1"] * time_scale, before, attached], 1))
    return separation


@jax.jit  # traced once for both passes
def _accelerations(chain: Chain, memories: _Memory, samples: _Sample) -> tuple[Vector, Vector]:
    """Specific force at the CG (m/s^2) and angular acceleration (rad/s^2), each (N,)."""

    def at(memory: _Memory, sample: _Sample) -> tuple[Vector, Vector]:
        air = _flow(sample)
        drive, _ = drive_of(chain, memory.actuators, memory.motor, jnp.zeros(6), sample.time)
        load = steady_load(chain, air, drive, memory.separation, sample.climb)
        load = unsteady_load(chain, air, load, sample.alpha_rate)
        return accelerations(chain.body, sample.rates, load.force, load.moment)

    found: tuple[Vector, Vector] = jax.vmap(at)(memories, samples)
    return found


def _shaken(chain: Chain, memory: _Memory, samples: _Sample, force: Vector) -> _Shaken:
    """The motion of an airframe that rings under a specific force (N,) at the CG."""
    mode = _rung(chain, force.z)
    samples = samples._replace(rates=_without_nod(chain, mode, samples.rates))
    force, acceleration = _accelerations(chain, memory, samples)
    return _Shaken(samples.rates, force, acceleration, mode)


def _rung(chain: Chain, load: Scalar) -> Scalar:
    """The structural mode (N, 2), displacement m and speed m/s, under a specific force (N,) along z, at rest first."""

    unit = jnp.eye(4)
    effects = jax.vmap(lambda mode, load0, load1: _ring(chain, mode, load0, load1))(unit[:, :2], unit[:, 2], unit[:, 3])

    def advance(mode: Scalar, loads: Scalar) -> tuple[Scalar, Scalar]:
        now = (jnp.concatenate([mode, loads])[:, None] * effects).sum(axis=0)
        return now, now

    loads = jnp.stack([jnp.concatenate([load[:1], load[:-1]]), load], 1)
    _, mode = jax.lax.scan(advance, jnp.stack(structure.start(chain.effects, load[0])), loads)
    return mode


def _without_nod(chain: Chain, mode: Scalar, rates: Vector) -> Vector:
    """The body's rates (N,) without what the structural mode adds to the gyroscopes.

    The mode is that under the force of the rates as they were read: what the nod adds to the force is small, and a mode
    that rings by its own nod would have no end.
    """
    _, nod = structure.felt(chain.effects, mode[:, 1], mode[:, 1])
    return rates._replace(y=rates.y - nod)


def _readings(chain: Chain, rates: Vector, force: Vector, acceleration: Vector, mode: Scalar) -> Accelerations:
    """What the instruments show of the motion, the airframe's own included."""
    effects, arm = chain.effects, sensors.imu_arm(chain.model, chain.effects, chain.body)
    _, mode_acceleration = structure.rate(effects, mode[:, 0], mode[:, 1], force.z)
    shake, nod = structure.felt(effects, mode_acceleration, mode_acceleration)
    at_imu = specific_force_at(force, rates, acceleration, arm)
    return Accelerations(
        sensors.accelerometers(effects, at_imu._replace(z=at_imu.z + shake)),
        sensors.turned_by(effects, acceleration._replace(y=acceleration.y + nod)),
    )


def _ring(chain: Chain, mode: Scalar, load0: Scalar, load1: Scalar) -> Scalar:
    """The structural mode (2,) one sample on, its load linear meanwhile, by Runge-Kutta as in a rollout.

    In two steps: of the fastest mode that may be tried, one at the rate of the diagnosis would grow without end.
    """

    def rate(y: Scalar, load: Scalar) -> Scalar:
        return jnp.stack(structure.rate(chain.effects, y[0], y[1], load))

    h, loads = 0.5 * chain.step, [load0 + share * (load1 - load0) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    for before, middle, after in (loads[:3], loads[2:]):
        k1 = rate(mode, before)
        k2 = rate(mode + 0.5 * h * k1, middle)
        k3 = rate(mode + 0.5 * h * k2, middle)
        k4 = rate(mode + h * k3, after)
        mode = mode + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return mode


@partial(jax.jit, static_argnums=0)
def _expected(layout: Layout, model: Model, theta: Scalar, signals: Signals, step: Scalar) -> Coefficients:
    return coefficients(model, signals, predict(layout, model, theta, signals, step))


def predict_coefficients(simulator: Simulator, theta: Scalar | Array, signals: Signals) -> Array:
    """CL CD CY Cl Cm Cn (N, 6) that parameters (P,) expect of these signals, as the aircraft file reduces them."""
    return np.stack(_expected(simulator.layout, simulator.model, theta, signals, simulator.step), axis=1)


@partial(jax.jit, static_argnums=0)
def _slopes(layout: Layout, model: Model, theta: Scalar, signals: Signals, step: Scalar) -> Coefficients:
    slopes: Coefficients = jax.jacfwd(lambda t: _expected(layout, model, t, signals, step))(theta)
    return slopes


def coefficient_slopes(simulator: Simulator, theta: Scalar | Array, signals: Signals) -> Array:
    """d ``predict_coefficients`` / d theta (N, 6, P), exact."""
    return np.stack(_slopes(simulator.layout, simulator.model, theta, signals, simulator.step), axis=1)
