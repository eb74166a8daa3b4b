"""The measured signals of a flight on the simulator's regular time base."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.attitude import quaternion, to_earth
from sysid_node.dynamics.vector import Vector
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.sim.model.layout import Scalar
from sysid_node.sim.simulator import Simulator

Array = NDArray[np.float64]


class MeasuredSignals(NamedTuple):
    """A flight as it was measured: N samples at a constant rate, at the times of the messages' stamps."""

    rates: Scalar  # (N, 3) p, q, r, rad/s
    air: Scalar  # (N, 3) V m/s, alpha, beta rad, at the probe
    density: Scalar  # (N,) kg/m^3
    commands: Scalar  # (N, controls + 1) rad, and thrust in N, as recorded
    climb: Scalar  # (N,) m since the start
    time: Scalar  # (N,) s since the recording began
    #: (N,) m/s, of the CG relative to the air, at the true times; replaces what follows from ``air`` where it is given.
    velocity: Vector | None = None
    alpha_rate: Scalar | None = None  # (N,) rad/s; replaces the difference quotient of alpha where it is given
    air_rotation: Vector | None = None  # (N,) rad/s, of the air about body axes; none where it is not known
    #: (N, K, controls) rad: the surfaces' commands at K times the rate, before the flight was low-passed; none where it
    #: was not. Servos that are not linear are driven by them, and the surfaces are low-passed.
    unfiltered: Scalar | None = None


#: Commands before the low-pass in the time of one sample.
COMMANDS_PER_SAMPLE = 4


def unfiltered_columns(name: str) -> tuple[str, ...]:
    """Columns of a low-passed record with a command before the low-pass, at each sample and between it and the next."""
    return tuple(f"{name}_unfiltered_{i}" for i in range(COMMANDS_PER_SAMPLE))


def signals_of(simulator: Simulator, record: FlightRecord, begin: float = 0.0) -> MeasuredSignals:
    """The signals of a record at the simulator's rate, by cubic interpolation; commands by linear interpolation.

    A record that was low-passed has the rate of the simulator already. Its time is zero ``begin`` s after the recording
    began. Raises InputError where rates, airspeed, flow
    angles, density, a control or the thrust of an aircraft with an engine is missing.
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
    return MeasuredSignals(
        rates=jnp.asarray(np.column_stack([smooth["p"], smooth["q"], smooth["r"]])),
        air=jnp.asarray(np.column_stack([smooth["V"], smooth["alpha"], smooth["beta"]])),
        density=jnp.asarray(smooth["rho"]),
        commands=jnp.asarray(np.column_stack(commands)),
        climb=jnp.asarray(_climb(record, time)),
        time=jnp.asarray(begin + time),
        unfiltered=_unfiltered(simulator, record),
    )


def _unfiltered(simulator: Simulator, record: FlightRecord) -> Scalar | None:
    """The commands (N, K, controls) before the low-pass; none where the record has none."""
    columns = [unfiltered_columns(name) for name in simulator.layout.symbols]
    if not all(name in record.columns for parts in columns for name in parts):
        return None
    return jnp.stack([jnp.stack([record.columns[name] for name in parts], 1) for parts in columns], 2)


def _climb(record: FlightRecord, time: Array) -> Array:
    """Height (N,) gained through the air since the start, m, from attitude, airspeed and flow angles.

    Zero where the attitude was not measured.
    """
    if not (np.isfinite(record["theta"]).all() and np.isfinite(record["phi"]).all()):
        return np.zeros_like(time)
    speed = np.asarray(_speed_of_climb(*(record[name] for name in ("phi", "theta", "V", "alpha", "beta"))))
    gained: Array = cumulative_trapezoid(speed, np.asarray(record.time), initial=0)
    return np.asarray(np.interp(time, record.time, gained))


@jax.jit
def _speed_of_climb(roll: Scalar, pitch: Scalar, airspeed: Scalar, alpha: Scalar, beta: Scalar) -> Scalar:
    """Upward speed (N,) through the air, m/s; angles in rad, airspeed in m/s."""
    attitude = quaternion((roll, pitch, jnp.zeros_like(roll)), jnp)
    climb: Scalar = -to_earth(attitude, Vector(*velocity_of((airspeed, alpha, beta), jnp))).z
    return climb
