"""From an aligned sample to the signals of the regression: coefficients, their regressors, angular momenta.

Each coefficient's equation is multiplied by k = qbar / qbar0, the dynamic pressure over its reference value,

    force or moment / (qbar0 S l) = k (C_0 + C_alpha alpha + C_q qhat + ...),

so that a moment's rate-of-momentum part is a plain derivative of a measured rate and needs neither a numerical
differentiation nor the derivative of the dynamic pressure: it enters as the increment of the angular momentum over a
sampling interval, which the transform integrates exactly (see ``fourier_transform``).

Where the aircraft file has lookup tables, k times what they add is subtracted from the coefficients' signals, and the
regression estimates the derivatives on top of them. The regressor CL^2 is that of the whole lift.

Equations of motion with all products of rates and Ixz: Klein & Morelli, "Aircraft System Identification" (2006), eqs.
3.35 to 3.37; coefficients from them eqs. 5.96 to 5.101. Body axes FRD, SI, radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS, STATE_REGRESSORS
from sysid_node.dynamics import scalar
from sysid_node.dynamics.airflow import flow_angles, speed_of, velocity_of
from sysid_node.dynamics.atmosphere import dynamic_pressure
from sysid_node.dynamics.coefficients import rate_regressors
from sysid_node.dynamics.forces import lift_and_drag, thrust_axes, thrust_line
from sysid_node.dynamics.lever_arm import tangential, velocity_from, without_centripetal
from sysid_node.dynamics.rigid_body import angular_momentum, gyroscopic_moment, known_moments
from sysid_node.dynamics.tables import TableSum, array_tables, full_thrust, need_mach, scalar_tables, table_variables
from sysid_node.dynamics.vector import Vector
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]
ScalarSignals = Callable[[Sequence[float]], tuple[list[float], list[float]]]
ArraySignals = Callable[[Sequence[Array]], tuple[list[Array], list[Array]]]
MomentumGain = Callable[[Any, Any], list[Any]]

#: What is taken out of every segment: the offset's regressor k, a constant and a slow drift.
NUISANCES = ("0", "1", "t")
OUTPUTS = len(COEFFICIENTS)
OFFSET = OUTPUTS + NUISANCES.index("0")
_CONTROLS = len(SAMPLE_COLUMNS)


@dataclass(frozen=True)
class SignalLayout:
    """Which column of the signal vector is what: six coefficients, three nuisances, then the regressors."""

    regressors: tuple[str, ...]  # controls come last
    timed: tuple[str, ...] = ()  # controls whose rates are transformed too, see ``actuator_lag_test``
    instrumented: tuple[str, ...] = ()  # regressors that have an instrument of their own, see ``instruments``
    with_thrust: bool = False  # whether the thrust is transformed too, which systematic errors need

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All columns in order."""
        rates = (f"{name} rate" for name in self.timed)
        instruments = (f"{name} instrument" for name in self.instrumented)
        thrust = ("thrust",) if self.with_thrust else ()
        return (*COEFFICIENTS, *NUISANCES, *self.regressors, *rates, *thrust, *instruments)

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.names)

    @property
    def transformed(self) -> int:
        """Number of columns that are transformed; the instruments, behind them, are made of their lines."""
        return self.width - len(self.instrumented)

    @cached_property
    def deflections(self) -> slice:
        """Columns of the controls."""
        end = OUTPUTS + len(NUISANCES) + len(self.regressors)
        return slice(end - len(self.timed), end)

    @cached_property
    def rates(self) -> slice:
        """Columns of the controls' rates, in the same order."""
        return slice(self.deflections.stop, self.deflections.stop + len(self.timed))

    @cached_property
    def differentiated(self) -> tuple[int, ...]:
        """Columns whose rates systematic errors need: coefficients, offset and state regressors."""
        first = OFFSET + len(NUISANCES)
        return (*range(OFFSET + 1), *range(first, first + len(self.regressors) - len(self.timed)))

    def column(self, name: str) -> int:
        """Index of a coefficient, nuisance or regressor."""
        return self.names.index(name)

    def instrument(self, regressor: str) -> int:
        """Index of the regressor's instrument: its own column where it has none."""
        return self.column(f"{regressor} instrument" if regressor in self.instrumented else regressor)


def layout(aircraft: Aircraft, instrumented: Sequence[str] = ()) -> SignalLayout:
    """The union of the regressors in the aircraft's model, each once, in the order of the file but controls last."""
    wanted = dict.fromkeys(r for regressors in aircraft.model_structure.values() for r in regressors if r != "0")
    timed = tuple(r for r in wanted if r in aircraft.control_symbols)
    states = tuple(r for r in wanted if r not in timed)
    with_thrust = aircraft.throttle is not None and any(sigma > 0.0 for sigma in aircraft.tolerances.values())
    return SignalLayout(states + timed, timed, tuple(r for r in states if r in instrumented), with_thrust)


def scalar_signals(aircraft: Aircraft) -> ScalarSignals:
    """Function from one sample to (signals without the drift, [cos alpha, sin alpha]).

    The vectorised twin is ``array_signals``; both perform the same operations in the same order, bit for bit.
    """
    tables = scalar_tables(aircraft.tables) if aircraft.tables else None
    return cast(ScalarSignals, _signals(aircraft, scalar, lambda _: 1.0, lambda _: 0.0, tables))


def array_signals(aircraft: Aircraft) -> ArraySignals:
    """As ``scalar_signals`` for columns (N,).

    Functions come from the scalar library, for equal bits; but roots, which IEEE 754 rounds alike everywhere.
    """

    def mapped(function: Callable[..., float]) -> Callable[..., Array]:
        return lambda *xs: np.fromiter(map(function, *(x.tolist() for x in xs)), np.float64, xs[0].size)

    functions = {name: mapped(getattr(scalar, name)) for name in ("cos", "sin", "arctan2", "exp", "log")}
    library = SimpleNamespace(**functions, sqrt=np.sqrt)
    tables = array_tables(aircraft.tables) if aircraft.tables else None
    return cast(ArraySignals, _signals(aircraft, library, np.ones_like, np.zeros_like, tables))


def _signals(aircraft: Aircraft, xp: Any, one: Any, none: Any, tables: TableSum | None) -> Any:
    """Build the signal function over scalars or arrays; see ``scalar_signals``. ``xp`` holds elementary functions."""
    subtract_tables = _subtraction(aircraft, xp, tables) if tables else None
    rho0, V0 = aircraft.reference.air_density, aircraft.reference.airspeed
    pressure0, span, chord = rho0 * V0 * V0, aircraft.geometry.b, aircraft.geometry.cbar
    force, roll, pitch = (1.0 / scale for scale in _scales(aircraft))
    mass, inertia = aircraft.mass * force, known_moments(aircraft.inertia)
    imu, probe = aircraft.sensors.imu, aircraft.sensors.air_data
    inclination, arm = thrust_line(aircraft.throttle)
    thrust_x, thrust_z = (share * force for share in thrust_axes(inclination, scalar))
    columns = layout(aircraft)
    names, timed, with_thrust = columns.regressors, columns.timed, columns.with_thrust
    candidates = (*(r for r in STATE_REGRESSORS if r != "0"), *aircraft.control_symbols)
    chosen = [candidates.index(name) for name in names]

    def signals(sample: Any) -> Any:
        ax, ay, az, p, q, r, V, alpha, beta, rho, thrust = sample[:11]
        rates = p, q, r
        velocity = velocity_from(velocity_of((V, alpha, beta), xp), rates, probe)
        _, alpha, beta = flow_angles(velocity, xp)
        V = speed_of(velocity, xp)
        # specific force at the CG: centripetal part of the lever arm here, tangential part in ``momentum_gain``
        fx, fy, fz = without_centripetal((ax, ay, az), rates, imu)
        k = rho * V * V / pressure0
        ca, sa = xp.cos(alpha), xp.sin(alpha)
        lift, drag = lift_and_drag(mass * fx - thrust_x * thrust, mass * fz - thrust_z * thrust, ca, sa)
        L, M, N = gyroscopic_moment(inertia, rates)
        half = 0.5 * k / V
        p_hat, q_hat, r_hat = rate_regressors(rates, 1.0, span * half, chord * half)  # times k
        known = [k * alpha, k * beta, p_hat, q_hat, r_hat, k * V / V0, lift * lift / k]
        known += [k * control for control in sample[_CONTROLS:]]
        row = [lift, drag, mass * fy, L * roll, (M - arm * thrust) * pitch, N * roll, k, one(k)]
        if subtract_tables:
            subtract_tables(row, k, (V, alpha, beta), rates, rho, thrust, sample[_CONTROLS:])
        row += [known[i] for i in chosen]
        row += [none(k)] * len(timed)  # rates come with the interval
        if with_thrust:
            row.append(thrust * force)
        # the angles carry the tangential acceleration of the lever arm into lift and drag
        return row, [ca, sa]

    return signals


def _subtraction(aircraft: Aircraft, xp: Any, tables: TableSum) -> Any:
    """Function that subtracts k times the tables from the coefficients in a row of signals."""
    span, chord, symbols = aircraft.geometry.b, aircraft.geometry.cbar, aircraft.control_symbols
    with_mach, full = need_mach(aircraft.tables), full_thrust(aircraft)

    def subtract(row: list[Any], k: Any, flow: Any, rates: Any, density: Any, thrust: Any, controls: Any) -> None:
        variables = table_variables(flow, rates, span, chord, density if with_mach else None, xp)
        variables["throttle"] = thrust / full
        variables.update(zip(symbols, controls, strict=False))  # a sample may hold the controls' excess behind them
        for coefficient, value in tables(variables).items():
            place = COEFFICIENTS.index(coefficient)
            row[place] = row[place] - k * value

    return subtract


def _scales(aircraft: Aircraft) -> tuple[float, float, float]:
    """Reference dynamic pressure times area (N), the same times span, and times chord (N m)."""
    reference, geometry = aircraft.reference, aircraft.geometry
    pressure_area = dynamic_pressure(reference.air_density, reference.airspeed) * geometry.S
    return pressure_area, pressure_area * geometry.b, pressure_area * geometry.cbar


def momentum_gain(aircraft: Aircraft) -> MomentumGain:
    """Function from p, q, r, cos alpha, sin alpha at both ends of an interval to what the six coefficients gain by it.

    That is the area (see ``fourier_transform``) of their parts in the angular accelerations. Scalars or columns.
    """
    (_, pY, pZ, pL, _, pN), (qX, _, qZ, _, qM, _), (rX, rY, _, rL, _, rN) = momentum_matrix(aircraft).tolist()

    def gain(before: Any, after: Any) -> list[Any]:
        p, q, r = after[0] - before[0], after[1] - before[1], after[2] - before[2]
        ca, sa = 0.5 * (before[3] + after[3]), 0.5 * (before[4] + after[4])
        X, Y, Z = qX * q + rX * r, pY * p + rY * r, pZ * p + qZ * q
        return [*lift_and_drag(X, Z, ca, sa), Y, pL * p + rL * r, qM * q, pN * p + rN * r]

    return gain


def momentum_matrix(aircraft: Aircraft) -> Array:
    """(3, 6) d(FX FY FZ L M N)/d(pdot qdot rdot): angular momentum, and the IMU's tangential acceleration.

    Force rows are body-axis forces over qbar0 S, moment rows are moments over qbar0 S b (or cbar).
    """
    reference, geometry = aircraft.reference, aircraft.geometry
    # the airspeed's square first: rounded otherwise, early estimates, which rest on next to no data, would differ
    pressure_area = dynamic_pressure(reference.air_density, 1.0) * reference.airspeed**2 * geometry.S
    mass = aircraft.mass / pressure_area
    roll, pitch = 1.0 / (pressure_area * geometry.b), 1.0 / (pressure_area * geometry.cbar)
    inertia, imu = known_moments(aircraft.inertia), Vector(*aircraft.sensors.imu)
    rows = []
    for unit in np.eye(3).tolist():
        acceleration = Vector(*unit)
        at_cg = tangential(acceleration, imu).times(-mass)  # the IMU's reading has it in addition
        L, M, N = angular_momentum(inertia, acceleration)
        rows.append([*at_cg, L * roll, M * pitch, N * roll])
    return np.array(rows)


def unformed(aircraft: Aircraft) -> dict[str, str]:
    """Coefficients whose equation cannot be formed, with the reason; empty where all inertias are known."""
    inertia = aircraft.inertia
    missing = {"Cl": inertia.Ixx, "Cm": inertia.Iyy, "Cn": inertia.Izz}
    return {c: "inertia unknown" for c, moment in missing.items() if math.isnan(moment)}
