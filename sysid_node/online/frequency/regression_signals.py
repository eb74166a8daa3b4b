"""From an aligned sample to the signals of the regression: coefficients, their regressors, angular momenta.

Each coefficient's equation is multiplied by k = qbar / qbar0, the dynamic pressure over its reference value,

    force or moment / (qbar0 S l) = k (C_0 + C_alpha alpha + C_q qhat + ...),

so that a moment's rate-of-momentum part is a plain derivative of a measured rate and needs neither a numerical
differentiation nor the derivative of the dynamic pressure: it enters as the increment of the angular momentum over a
sampling interval, which the transform integrates exactly (see ``transform``).

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
class Layout:
    """Which column of the signal vector is what: six coefficients, three nuisances, then the regressors."""

    regressors: tuple[str, ...]  # controls come last
    timed: tuple[str, ...] = ()  # controls whose rates are transformed too, see ``timing``
    instrumented: tuple[str, ...] = ()  # regressors that have an instrument of their own, see ``auxiliary``

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All columns in order."""
        rates = (f"{name} rate" for name in self.timed)
        instruments = (f"{name} instrument" for name in self.instrumented)
        return (*COEFFICIENTS, *NUISANCES, *self.regressors, *rates, *instruments)

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

    def column(self, name: str) -> int:
        """Index of a coefficient, nuisance or regressor."""
        return self.names.index(name)

    def instrument(self, regressor: str) -> int:
        """Index of the regressor's instrument: its own column where it has none."""
        return self.column(f"{regressor} instrument" if regressor in self.instrumented else regressor)


def layout(aircraft: Aircraft, instrumented: Sequence[str] = ()) -> Layout:
    """The union of the regressors in the aircraft's model, each once, in the order of the file but controls last."""
    wanted = dict.fromkeys(r for regressors in aircraft.model_structure.values() for r in regressors if r != "0")
    timed = tuple(r for r in wanted if r in aircraft.control_symbols)
    states = tuple(r for r in wanted if r not in timed)
    return Layout(states + timed, timed, tuple(r for r in states if r in instrumented))


def scalar_signals(aircraft: Aircraft) -> ScalarSignals:
    """Function from one sample to (signals without the drift, [cos alpha, sin alpha]).

    The vectorised twin is ``array_signals``; both perform the same operations in the same order, bit for bit.
    """
    return cast(ScalarSignals, _signals(aircraft, math, lambda _: 1.0, lambda _: 0.0))


def array_signals(aircraft: Aircraft) -> ArraySignals:
    """As ``scalar_signals`` for columns (N,).

    Functions come from the scalar library, for equal bits; but roots, which IEEE 754 rounds alike everywhere.
    """

    def mapped(function: Callable[..., float]) -> Callable[..., Array]:
        return lambda *xs: np.fromiter(map(function, *(x.tolist() for x in xs)), np.float64, xs[0].size)

    functions = {name: mapped(getattr(math, name)) for name in ("cos", "sin", "atan2")}
    return cast(
        ArraySignals, _signals(aircraft, SimpleNamespace(**functions, sqrt=np.sqrt), np.ones_like, np.zeros_like)
    )


def _signals(aircraft: Aircraft, functions: Any, one: Any, none: Any) -> Any:
    """Build the signal function over scalars or arrays; see ``scalar_signals``."""
    cos, sin, sqrt, atan2 = functions.cos, functions.sin, functions.sqrt, functions.atan2
    m, S, b, c = aircraft.mass, aircraft.geometry.S, aircraft.geometry.b, aircraft.geometry.cbar
    rho0, V0 = aircraft.reference.air_density, aircraft.reference.airspeed
    qbar0 = 0.5 * rho0 * V0 * V0
    force, roll, pitch = 1.0 / (qbar0 * S), 1.0 / (qbar0 * S * b), 1.0 / (qbar0 * S * c)
    mass = m * force
    Ixx, Iyy, Izz, Ixz = (_known(v) for v in _inertias(aircraft))
    xi, yi, zi = aircraft.sensors.imu
    xa, ya, za = aircraft.sensors.air_data
    throttle = aircraft.throttle
    incline, arm = (throttle.inclination, throttle.arm) if throttle else (0.0, 0.0)
    cos_t, sin_t = math.cos(incline) * force, math.sin(incline) * force
    names, timed = layout(aircraft).regressors, layout(aircraft).timed
    candidates = (*(r for r in STATE_REGRESSORS if r != "0"), *aircraft.control_symbols)
    chosen = [candidates.index(name) for name in names]

    def signals(sample: Any) -> Any:
        ax, ay, az, p, q, r, V, alpha, beta, rho, thrust = sample[:11]
        # the flow at the CG: the air-data probe's own speed, omega x arm, is in what it measures
        forward = V * cos(beta)
        u = forward * cos(alpha) - (q * za - r * ya)
        v = V * sin(beta) - (r * xa - p * za)
        w = forward * sin(alpha) - (p * ya - q * xa)
        upright = sqrt(u * u + w * w)
        V = sqrt(u * u + v * v + w * w)
        alpha, beta = atan2(w, u), atan2(v, upright)
        # specific force at the CG: centripetal part of the lever arm here, tangential part below
        ax = ax + (q * q + r * r) * xi - p * q * yi - p * r * zi
        ay = ay - p * q * xi + (p * p + r * r) * yi - q * r * zi
        az = az - p * r * xi - q * r * yi + (p * p + q * q) * zi
        k = rho * V * V / (rho0 * V0 * V0)
        FX, FY, FZ = mass * ax - cos_t * thrust, mass * ay, mass * az + sin_t * thrust
        ca, sa = cos(alpha), sin(alpha)
        lift, drag = FX * sa - FZ * ca, -FX * ca - FZ * sa
        L = ((Izz - Iyy) * q * r - Ixz * p * q) * roll
        M = ((Ixx - Izz) * p * r + Ixz * (p * p - r * r) - arm * thrust) * pitch
        N = ((Iyy - Ixx) * p * q + Ixz * q * r) * roll
        half = 0.5 * k / V
        span, chord = b * half, c * half
        known = [k * alpha, k * beta, p * span, q * chord, r * span, k * V / V0, lift * lift / k]
        known += [k * control for control in sample[_CONTROLS:]]
        row = [lift, drag, FY, L, M, N, k, one(k)]
        row += [known[i] for i in chosen]
        row += [none(k)] * len(timed)  # rates come with the interval
        # the angles carry the tangential acceleration of the lever arm into lift and drag
        return row, [ca, sa]

    return signals


def momentum_gain(aircraft: Aircraft) -> MomentumGain:
    """Function from p, q, r, cos alpha, sin alpha at both ends of an interval to what the six coefficients gain by it.

    That is the area (see ``transform``) of their parts in the angular accelerations. Scalars or columns.
    """
    (_, pY, pZ, pL, _, pN), (qX, _, qZ, _, qM, _), (rX, rY, _, rL, _, rN) = momentum_matrix(aircraft).tolist()

    def gain(before: Any, after: Any) -> list[Any]:
        p, q, r = after[0] - before[0], after[1] - before[1], after[2] - before[2]
        ca, sa = 0.5 * (before[3] + after[3]), 0.5 * (before[4] + after[4])
        X, Y, Z = qX * q + rX * r, pY * p + rY * r, pZ * p + qZ * q
        return [X * sa - Z * ca, -X * ca - Z * sa, Y, pL * p + rL * r, qM * q, pN * p + rN * r]

    return gain


def momentum_matrix(aircraft: Aircraft) -> Array:
    """(3, 6) d(FX FY FZ L M N)/d(pdot qdot rdot): angular momentum, and the IMU's tangential acceleration.

    Force rows are body-axis forces over qbar0 S, moment rows are moments over qbar0 S b (or cbar).
    """
    g = aircraft.geometry
    qbar0 = 0.5 * aircraft.reference.air_density * aircraft.reference.airspeed**2
    Ixx, Iyy, Izz, Ixz = (_known(v) for v in _inertias(aircraft))
    x, y, z = aircraft.sensors.imu
    mass = aircraft.mass / (qbar0 * g.S)
    roll, pitch = 1.0 / (qbar0 * g.S * g.b), 1.0 / (qbar0 * g.S * g.cbar)
    # a_cg = a_imu - omega_dot x r: columns are the axes of the force
    tangential = mass * np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    moments = np.array([[Ixx * roll, 0.0, -Ixz * roll], [0.0, Iyy * pitch, 0.0], [-Ixz * roll, 0.0, Izz * roll]])
    return np.hstack([tangential, moments])


def unformed(aircraft: Aircraft) -> dict[str, str]:
    """Coefficients whose equation cannot be formed, with the reason; empty where all inertias are known."""
    Ixx, Iyy, Izz, _ = _inertias(aircraft)
    missing = {"Cl": Ixx, "Cm": Iyy, "Cn": Izz}
    return {c: "inertia unknown" for c, inertia in missing.items() if math.isnan(inertia)}


def _inertias(aircraft: Aircraft) -> tuple[float, float, float, float]:
    i = aircraft.inertia
    return i.Ixx, i.Iyy, i.Izz, i.Ixz


def _known(value: float) -> float:
    """An inertia that is not known leaves its products of rates out (``unformed`` names the lost equations)."""
    return 0.0 if math.isnan(value) else value
