"""Flights with a known truth for tests of the online estimator: exact motion, and a small flight simulator. NumPy only.

Written apart from the package: it knows of the aircraft's description and of the sample's columns, and of nothing else.
Equations: Stevens, Lewis & Johnson, "Aircraft Control and Simulation" (2016), table 1.7-1, body axes FRD, flat Earth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from sysid_node.aircraft.model import Aircraft, Control, Derivative, Geometry, Inertia, ReferenceCondition, Throttle
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]
G = 9.80665

TRUTH = {
    **{"CL_0": 0.15, "CL_alpha": 3.4, "CL_q": 3.0, "CL_de": 0.6},
    **{"CD_0": 0.03, "CD_alpha": 0.25, "CD_q": 0.2, "CD_de": 0.05},
    **{"Cm_0": 0.02, "Cm_alpha": -0.5, "Cm_q": -2.5, "Cm_de": -0.6},
    **{"CY_beta": -0.4, "CY_p": 0.05, "CY_r": 0.2, "CY_da": 0.02, "CY_dr": 0.15},
    **{"Cl_beta": -0.1, "Cl_p": -0.35, "Cl_r": 0.1, "Cl_da": -0.2, "Cl_dr": 0.01},
    **{"Cn_beta": 0.08, "Cn_p": -0.03, "Cn_r": -0.12, "Cn_da": 0.01, "Cn_dr": -0.07},
}


def made_aircraft(derivatives: Mapping[str, float] = TRUTH, **changes: object) -> Aircraft:
    """A 3.5 kg UAV whose file is right, with derivatives' tolerances of 10 %; ``changes`` replace its fields.

    It is a simulator's: all but the derivatives is exactly known.
    """
    surfaces = {"elevator": "de", "aileron": "da", "rudder": "dr"}
    aircraft = Aircraft(
        name="made",
        source="made up for tests",
        mass=3.5,
        inertia=Inertia(0.16, 0.22, 0.36, 0.01),
        geometry=Geometry(0.55, 1.4, 0.45),
        reference=ReferenceCondition(18.0, 1.2),
        controls={name: Control(name, symbol, {name: 1.0}) for name, symbol in surfaces.items()},
        derivatives={name: Derivative(value, max(0.1 * abs(value), 0.01)) for name, value in derivatives.items()},
        throttle=Throttle("throttle", 30.0),
        ideal=True,
        noise_bias=dict.fromkeys(("accel", "gyro", "alpha", "beta", "airspeed"), 0.0),
    )
    return replace(aircraft, **changes)


class Model:
    """The aircraft file's linear model: coefficients (6, N) from regressors; ``CD_k`` multiplies CL squared."""

    def __init__(self, aircraft: Aircraft) -> None:
        symbols = aircraft.control_symbols
        self.regressors = ("0", "alpha", "beta", "p", "q", "r", "V", *symbols)
        self.matrix = np.zeros((6, len(self.regressors)))
        self.induced = 0.0
        for name, derivative in aircraft.derivatives.items():
            coefficient, _, regressor = name.partition("_")
            if regressor == "k":
                self.induced = derivative.value
            else:
                self.matrix[COEFFICIENTS.index(coefficient), self.regressors.index(regressor)] = derivative.value

    def effect(self, coefficient: str, regressor: str) -> float:
        """One derivative."""
        return float(self.matrix[COEFFICIENTS.index(coefficient), self.regressors.index(regressor)])

    def __call__(self, regressors: Array, added: Array | float = 0.0) -> Array:
        """Rows of ``regressors`` in the order of the names; ``added`` (6, N) is what the linear model does not hold."""
        found: Array = self.matrix @ regressors + added
        found[1] += self.induced * found[0] ** 2
        return found


def _regressors(aircraft: Aircraft, air: Sequence[Array], omega: Array, controls: Array) -> Array:
    """(R, N) in ``Model``'s order, from airspeed, alpha, beta; p, q, r; controls."""
    V, alpha, beta = air
    b, c = aircraft.geometry.b / (2.0 * V), aircraft.geometry.cbar / (2.0 * V)
    p, q, r = omega
    speed = V / aircraft.reference.airspeed
    return np.concatenate([[np.ones_like(V), alpha, beta, p * b, q * c, r * b, speed], controls])


class Sines:
    """A smooth random signal with its exact derivative: ``mean`` and ``count`` sines of 0.1 to 1.6 Hz."""

    def __init__(self, rng: np.random.Generator, amplitude: float, mean: float = 0.0, count: int = 12) -> None:
        self.mean = mean
        self.amplitudes = amplitude * rng.uniform(0.3, 1.0, count) * math.sqrt(2.0 / count)
        self.omega = 2.0 * math.pi * rng.uniform(0.1, 1.6, count)
        self.phases = rng.uniform(0.0, 2.0 * math.pi, count)

    def __call__(self, time: Array) -> Array:
        """Value (N,)."""
        return self.mean + np.sin(np.outer(time, self.omega) + self.phases) @ self.amplitudes

    def rate(self, time: Array) -> Array:
        """Derivative (N,)."""
        return np.cos(np.outer(time, self.omega) + self.phases) @ (self.amplitudes * self.omega)


def exact_flight(
    aircraft: Aircraft, time: Array, seed: int = 0, extra: Mapping[str, Array] | None = None, alpha: float = 0.08
) -> Array:
    """Noise-free samples (N, M) at any times (N,) s of a motion that is prescribed, with its exact derivatives.

    Rates, airspeed, flow angles, thrust and spare controls are sums of sines; the specific force follows from the
    model, and de, da, dr are what the prescribed angular accelerations need. ``extra`` (N,) adds to coefficients what
    the linear model does not hold. ``alpha`` rad is the mean angle of attack.
    """
    rng, g = np.random.default_rng(seed), aircraft.geometry
    rates = [Sines(rng, amplitude) for amplitude in (0.5, 0.35, 0.3)]
    omega, domega = np.array([s(time) for s in rates]), np.array([s.rate(time) for s in rates])
    V, a, beta = Sines(rng, 1.0, 18.3)(time), Sines(rng, 0.05, alpha)(time), Sines(rng, 0.05)(time)
    rho, thrust = Sines(rng, 0.01, 1.15)(time), Sines(rng, 1.0, 5.0)(time)
    model, symbols = Model(aircraft), aircraft.control_symbols
    controls = np.array([Sines(rng, 0.05)(time) for _ in symbols])
    controls[[symbols.index(s) for s in ("de", "da", "dr")]] = 0.0
    added = np.array([(extra or {}).get(c, np.zeros_like(time)) for c in COEFFICIENTS])
    qS = 0.5 * rho * V**2 * g.S
    unheld = model(_regressors(aircraft, (V, a, beta), omega, controls), added)
    needed = _moments(aircraft, qS, omega, domega, thrust) - unheld[3:]
    lateral = np.array([[model.effect(c, r) for r in ("da", "dr")] for c in ("Cl", "Cn")])
    da, dr = np.linalg.solve(lateral, needed[[0, 2]])
    for symbol, value in (("de", needed[1] / model.effect("Cm", "de")), ("da", da), ("dr", dr)):
        controls[symbols.index(symbol)] = value
    found = model(_regressors(aircraft, (V, a, beta), omega, controls), added)
    force = _specific_force(aircraft, found, qS, a, thrust)
    arm = np.array(aircraft.sensors.imu)[:, None]
    ax, ay, az = force + np.cross(domega, arm, axis=0) + np.cross(omega, np.cross(omega, arm, axis=0), axis=0)
    u, v, w = _velocity(V, a, beta) + np.cross(omega, np.array(aircraft.sensors.air_data)[:, None], axis=0)
    seen = np.sqrt(u**2 + v**2 + w**2)
    columns = (ax, ay, az, *omega, seen, np.arctan2(w, u), np.arcsin(v / seen), rho, thrust, np.gradient(time))
    return np.column_stack([*columns, *controls])


def _moments(aircraft: Aircraft, qS: Array, omega: Array, domega: Array, thrust: Array) -> Array:
    """Cl, Cm, Cn (3, N) of a motion."""
    g, i = aircraft.geometry, aircraft.inertia
    tensor = np.array([[i.Ixx, 0.0, -i.Ixz], [0.0, i.Iyy, 0.0], [-i.Ixz, 0.0, i.Izz]])
    moments = tensor @ domega + np.cross(omega, tensor @ omega, axis=0)
    moments[1] -= aircraft.throttle.arm * thrust if aircraft.throttle else 0.0
    return moments / (qS * np.array([[g.b], [g.cbar], [g.b]]))


def _velocity(V: Array, alpha: Array, beta: Array) -> Array:
    return np.array([V * np.cos(alpha) * np.cos(beta), V * np.sin(beta), V * np.sin(alpha) * np.cos(beta)])


def _specific_force(aircraft: Aircraft, found: Array, qS: Array, alpha: Array, thrust: Array) -> Array:
    """(3, N) m/s^2 at the CG: lift and drag turned by alpha alone, thrust along its line."""
    CL, CD, CY = found[:3]
    cos, sin = np.cos(alpha), np.sin(alpha)
    incline = aircraft.throttle.inclination if aircraft.throttle else 0.0
    X = qS * (CL * sin - CD * cos) + thrust * math.cos(incline)
    Z = qS * (-CL * cos - CD * sin) - thrust * math.sin(incline)
    return np.array([X, qS * CY, Z]) / aircraft.mass


def multisteps(seconds: float, rate: float, seed: int = 5, amplitude: float = 0.06) -> Array:
    """Surface commands (n, 3) rad about trim: 3-2-1-1s of random widths and signs on every surface, all the time."""
    rng, time = np.random.default_rng(seed), np.arange(round(seconds * rate)) / rate
    commands = np.zeros((time.size, 3))
    for surface in range(3):
        start = 0.3 + 0.4 * surface
        while start < seconds:
            width, sign = rng.uniform(0.15, 0.35), rng.choice([-1.0, 1.0])
            steps = np.floor((time - start) / width)
            for sense, steps_of in ((1.0, (0, 1, 2)), (-1.0, (3, 4)), (1.0, (5,)), (-1.0, (6,))):
                commands[np.isin(steps, steps_of), surface] = sense * sign * amplitude
            start += 7 * width + rng.uniform(0.3, 1.5)
    return commands


def dryden(rng: np.random.Generator, samples: int, flights: int, rate: float, airspeed: float, sigma: float) -> Array:
    """Gusts (n, 3, F) m/s of 1-sigma ``sigma``, scale length 100 m (MIL-F-8785C, transverse form on all axes)."""
    pole = airspeed / 100.0
    numerator, denominator, _ = cont2discrete(
        ([1.0, pole / math.sqrt(3.0)], [1.0, 2 * pole, pole**2]), 1 / rate, "tustin"
    )
    warm = 4096
    impulse = lfilter(numerator.ravel(), denominator, np.eye(1, warm)[0])
    noise = rng.standard_normal((samples + warm, 3, flights))
    gusts = lfilter(numerator.ravel(), denominator, noise, axis=0)[warm:]
    return sigma / math.sqrt(float(impulse @ impulse)) * gusts


def fly(
    aircraft: Aircraft,
    commands: Array,
    rate: float = 100.0,
    flights: int = 1,
    seed: int = 0,
    gusts: float = 0.0,
    closed_loop: bool = True,
    noise: float = 1.0,
    after: tuple[float, Mapping[str, float]] | None = None,
) -> tuple[Array, Array]:
    """Simulate F flights of ``commands`` (n, 3) rad about trim: time (n,) s and samples (F, n, M), with noise.

    ``gusts`` m/s is the turbulence's 1 sigma, ``noise`` a factor on the file's sensor noise; in ``closed_loop`` an
    autopilot feeds noisy rates and true attitude back. ``after`` (s, factors by name) changes derivatives once.
    """
    rng = np.random.default_rng(seed)
    n, V0 = len(commands), aircraft.reference.airspeed
    model, changed = Model(aircraft), Model(_changed(aircraft, after[1])) if after else None
    air = dryden(rng, n + 1, flights, rate, V0, gusts) if gusts else np.zeros((n + 1, 3, flights))
    surfaces, thrust, x = _trimmed(aircraft, flights)
    trim, pitch = surfaces.copy(), x[7].copy()
    names = (*("accel",) * 3, *("gyro",) * 3, "airspeed", "alpha", "beta")
    scale = noise * np.array([[aircraft.noise[name]] for name in names])
    readings = np.empty((n, 12, flights))
    keep = math.exp(-1.0 / (0.03 * rate))  # the actuators' lag, 30 ms
    for i in range(n):
        if after is not None and changed is not None and i >= after[0] * rate:
            model = changed
        slope, force, seen = _rates(aircraft, model, x, surfaces, thrust, air[i])
        readings[i] = np.concatenate([force, x[3:6], seen, surfaces])
        readings[i, :9] += scale * rng.standard_normal((9, flights))
        command = trim + commands[i][:, None]
        if closed_loop:
            p, q, r = readings[i, 3:6]
            command = command + np.array([0.3 * (x[7] - pitch) + 0.15 * q, 0.3 * x[6] + 0.08 * p, 0.1 * r])
        surfaces = command + (surfaces - command) * keep
        # Heun's rule: the second slope at the predicted end of the step
        ahead = _rates(aircraft, model, x + slope / rate, surfaces, thrust, air[i + 1])[0]
        x = x + (slope + ahead) / (2.0 * rate)
    fixed = {"rho": aircraft.reference.air_density, "thrust": thrust, "air_interval": 1.0 / rate}
    columns = [readings[:, :9], *(np.full((n, 1, flights), fixed[c]) for c in SAMPLE_COLUMNS[9:]), readings[:, 9:]]
    return np.arange(n) / rate, np.ascontiguousarray(np.concatenate(columns, axis=1).transpose(2, 0, 1))


def _changed(aircraft: Aircraft, factors: Mapping[str, float]) -> Aircraft:
    changed = {n: replace(d, value=d.value * factors.get(n, 1.0)) for n, d in aircraft.derivatives.items()}
    return replace(aircraft, derivatives=changed)


def _trimmed(aircraft: Aircraft, flights: int) -> tuple[Array, float, Array]:
    """Surfaces (3, F), thrust N and state (8, F) of straight level flight at the reference airspeed (Newton's rule)."""
    V, model, still = aircraft.reference.airspeed, Model(aircraft), np.zeros((3, 1))

    def state(alpha: float) -> Array:
        return np.array([V * math.cos(alpha), 0.0, V * math.sin(alpha), 0.0, 0.0, 0.0, 0.0, alpha])[:, None]

    def unbalance(z: Array) -> Array:
        surfaces = np.array([[z[1]], [0.0], [0.0]])
        return _rates(aircraft, model, state(z[0]), surfaces, z[2], still)[0][[0, 2, 4], 0]

    z = np.array([0.08, -0.05, 5.0])
    for _ in range(8):
        slopes = np.array([(unbalance(z + h) - unbalance(z - h)) / 2e-4 for h in 1e-4 * np.eye(3)]).T
        z = z - np.linalg.solve(slopes, unbalance(z))
    return np.tile([[z[1]], [0.0], [0.0]], flights), float(z[2]), np.tile(state(z[0]), flights)


def _rates(
    aircraft: Aircraft, model: Model, x: Array, surfaces: Array, thrust: float, gust: Array
) -> tuple[Array, Array, Array]:
    """State's derivative (8, F), specific force (3, F), and airspeed, alpha, beta (3, F); x = u v w p q r phi theta."""
    i = aircraft.inertia
    u, v, w, p, q, r, phi, theta = x
    ua, va, wa = x[:3] - gust
    V = np.sqrt(ua * ua + va * va + wa * wa)
    seen = np.array([V, np.arctan2(wa, ua), np.arcsin(va / V)])
    found = model(_regressors(aircraft, seen, x[3:6], surfaces))
    qS = 0.5 * aircraft.reference.air_density * V * V * aircraft.geometry.S
    fx, fy, fz = force = _specific_force(aircraft, found, qS, seen[1], np.asarray(thrust))
    roll = qS * aircraft.geometry.b * found[3] - (i.Izz - i.Iyy) * q * r + i.Ixz * p * q
    pitch = qS * aircraft.geometry.cbar * found[4] - (i.Ixx - i.Izz) * p * r - i.Ixz * (p * p - r * r)
    yaw = qS * aircraft.geometry.b * found[5] - (i.Iyy - i.Ixx) * p * q - i.Ixz * q * r
    det = i.Ixx * i.Izz - i.Ixz**2
    sphi, cphi, stheta, ctheta = np.sin(phi), np.cos(phi), np.sin(theta), np.cos(theta)
    slope = np.array(
        [
            fx - G * stheta + r * v - q * w,
            fy + G * sphi * ctheta + p * w - r * u,
            fz + G * cphi * ctheta + q * u - p * v,
            (i.Izz * roll + i.Ixz * yaw) / det,
            pitch / i.Iyy,
            (i.Ixz * roll + i.Ixx * yaw) / det,
            p + (q * sphi + r * cphi) * stheta / ctheta,
            q * cphi - r * sphi,
        ]
    )
    return slope, force, seen
