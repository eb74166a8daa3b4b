"""An aircraft of the aircraft file's derivatives, with its effects: six degrees of freedom in plain floats.

Equations: Stevens, Lewis & Johnson (2016), "Aircraft Control and Simulation", ch. 1. Euler angles, and Heun's rule with
surfaces and gusts held over the step: another integrator than the simulator's, at a rate that makes it exact enough.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.optimize import least_squares

from bench.withheld.plants.aerodynamics import Separation, additions
from bench.withheld.plants.motion import GRAVITY, DivergedError, Effects, Flow, Instant, cross, flow_angles
from bench.withheld.plants.slosh import Slosh
from sysid_node.aircraft.model import Aircraft

State = tuple[float, ...]  # u v w p q r phi theta psi height

_STILL = (0.0,) * 6
_SEA_LEVEL, _EXPONENT, _LAPSE = 1.225, 4.25588, 2.25577e-5  # density of the standard atmosphere, ICAO Doc 7488
_WASHED = ("elevator", "rudder")


class Rigid:
    """One aircraft; ``rate`` (Hz) of the integration."""

    def __init__(self, aircraft: Aircraft, effects: Effects, rate: float) -> None:
        self.aircraft, self.effects, self.step_s = aircraft, effects, 1.0 / rate
        self.controls = tuple(aircraft.controls)
        self._terms = _terms(aircraft, effects.get("derivative_error", {}))
        flow = {n: v for n, v in effects.items() if n != "derivative_error"}
        self._additions = additions(flow, aircraft)
        self._separation = Separation(effects.get("stall_separation", {}))
        self._slosh = Slosh(effects.get("slosh", {}), aircraft.mass)
        self._masses()
        density = aircraft.reference.air_density
        self._height = (1.0 - (density / _SEA_LEVEL) ** (1.0 / _EXPONENT)) / _LAPSE
        self._alpha, self._alpha_rate = 0.0, 0.0
        self._initial, self.trim = self._trimmed()
        self._state = self._initial

    def _masses(self) -> None:
        shift, mass = self.effects.get("cg_shift", {}), self.effects.get("mass_error", {})
        more, inertia = self.effects.get("inertia_error", {}), self.aircraft.inertia
        self.cg = (shift.get("x", 0.0), shift.get("y", 0.0), shift.get("z", 0.0))
        self.mass = self.aircraft.mass * (1.0 + mass.get("error", 0.0))
        self._inertia = (
            inertia.Ixx * (1.0 + more.get("Ixx", 0.0)),
            inertia.Iyy * (1.0 + more.get("Iyy", 0.0)),
            inertia.Izz * (1.0 + more.get("Izz", 0.0)),
            inertia.Ixz + more.get("Ixz", 0.0) * math.sqrt(inertia.Ixx * inertia.Izz),
        )

    def start(self) -> Instant:
        """Back to the trim."""
        self._state, self._alpha_rate = self._initial, 0.0
        self._slosh.start()
        _, instant = self._rates(self._state, self.trim, self.trim["thrust"], _STILL, 0.0)
        self._alpha = flow_angles(instant.flow)[1]
        self._separation.start(self._alpha)
        return instant

    def step(self, surfaces: Mapping[str, float], thrust: float, gusts: tuple[float, ...], time: float) -> Instant:
        """One step of Heun's rule, then the motion at its end."""
        h, x = self.step_s, self._state
        k1, _ = self._rates(x, surfaces, thrust, gusts, time - h)
        k2, _ = self._rates(tuple(a + h * b for a, b in zip(x, k1, strict=True)), surfaces, thrust, gusts, time)
        self._state = tuple(a + 0.5 * h * (b + c) for a, b, c in zip(x, k1, k2, strict=True))
        _, now = self._rates(self._state, surfaces, thrust, gusts, time)
        self._remember(now)
        if not (abs(self._state[7]) < 1.4 and abs(now.force[2]) < 500.0 and math.isfinite(self._state[6])):
            raise DivergedError(f"at {time:.1f} s")
        return now

    def meter(self, commanded: float) -> float:
        """The command: nothing measures the thrust."""
        return commanded

    def _remember(self, now: Instant) -> None:
        """What has a memory: the rate of alpha, gusts' share of it included, the flow's separation, the fuel."""
        speed, alpha, _ = flow_angles(now.flow)
        rate, self._alpha = (alpha - self._alpha) / self.step_s, alpha
        time_scale = self.aircraft.geometry.cbar / speed
        self._alpha_rate = 0.5 * time_scale * rate
        self._separation.advance(alpha, rate, time_scale, self.step_s)
        self._slosh.advance(now.force, self.step_s)

    def _rates(
        self, x: State, surfaces: Mapping[str, float], thrust: float, gusts: tuple[float, ...], time: float
    ) -> tuple[State, Instant]:
        u, v, w, p, q, r, phi, theta, psi, height = x
        flow, turned = (u - gusts[0], v - gusts[1], w - gusts[2]), (p - gusts[3], q - gusts[4], r - gusts[5])
        density = _SEA_LEVEL * (1.0 - _LAPSE * height) ** _EXPONENT
        force, moment = self._load(flow, turned, density, surfaces, thrust, time)
        turning = self._turning((p, q, r), force, moment)
        fx, fy, fz = (f / self.mass for f in force)
        sp, cp, st, ct = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
        rates = (
            fx - GRAVITY * st + r * v - q * w,
            fy + GRAVITY * ct * sp + p * w - r * u,
            fz + GRAVITY * ct * cp + q * u - p * v,
            *turning,
            p + (q * sp + r * cp) * st / ct,
            q * cp - r * sp,
            (q * sp + r * cp) / ct,
            u * st - v * sp * ct - w * cp * ct,
        )
        return rates, Instant((fx, fy, fz), turning, (p, q, r), (phi, theta, psi), flow, turned, density)

    def _turning(
        self, rates: tuple[float, float, float], force: tuple[float, float, float], moment: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        """Euler's equation about the true centre of gravity."""
        p, q, r = rates
        Ixx, Iyy, Izz, Ixz = self._inertia
        arm = cross(self.cg, force)
        L, M, N = (m - a for m, a in zip(moment, arm, strict=True))
        L -= (Izz - Iyy) * q * r - Ixz * p * q
        M -= (Ixx - Izz) * p * r + Ixz * (p * p - r * r)
        N -= (Iyy - Ixx) * p * q + Ixz * q * r
        whole = Ixx * Izz - Ixz * Ixz
        return (Izz * L + Ixz * N) / whole, M / Iyy, (Ixz * L + Ixx * N) / whole

    def _load(
        self,
        flow: tuple[float, float, float],
        turned: tuple[float, float, float],
        density: float,
        surfaces: Mapping[str, float],
        thrust: float,
        time: float,
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Force and moment about the file's centre of gravity."""
        speed, alpha, beta = flow_angles(flow)
        geometry = self.aircraft.geometry
        scale, half = 0.5 * density * speed * speed * geometry.S, 0.5 / speed
        rates = turned[0] * geometry.b * half, turned[1] * geometry.cbar * half, turned[2] * geometry.b * half
        CL, CD, CY, Cl, Cm, Cn = self._coefficients(alpha, beta, rates, surfaces, thrust / scale, time)
        cos, sin = math.cos(alpha), math.sin(alpha)
        pull, (L, M, N) = self._propulsion(thrust, alpha)
        fuel, tilt = self._slosh.load()
        force = (
            scale * (CL * sin - CD * cos) + pull[0],
            scale * CY + fuel[1],
            -scale * (CL * cos + CD * sin) + pull[2],
        )
        return force, (
            scale * geometry.b * Cl + L + tilt[0],
            scale * geometry.cbar * Cm + M + tilt[1],
            scale * geometry.b * Cn + N + tilt[2],
        )

    def _coefficients(
        self,
        alpha: float,
        beta: float,
        rates: tuple[float, float, float],
        surfaces: Mapping[str, float],
        load: float,
        time: float,
    ) -> list[float]:
        """CL, CD, CY, Cl, Cm, Cn; ``load`` is thrust over dynamic pressure and area."""
        wash = 1.0 + self.effects.get("propwash", {}).get("gain", 0.0) * load
        bent = [surfaces[c] * (wash if c in _WASHED else 1.0) for c in self.controls]
        x = (1.0, alpha, beta, *rates, *bent)
        total = [sum(a * b for a, b in zip(row, x, strict=True)) for row in self._terms]
        CL = total[0]
        total[0] = CL * self._separation.lift_factor()
        drag, pitch = self._separation.drag_and_moment()
        total[1] += drag
        total[4] += pitch
        if self._additions:
            seen = Flow(alpha, beta, *rates, self._alpha_rate, CL, time)
            for addition in self._additions:
                for i, more in enumerate(addition(seen)):
                    total[i] += more
        return total

    def _propulsion(self, thrust: float, alpha: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        throttle, yaw = self.aircraft.throttle, self.effects.get("thrust_yaw", {})
        inclination, arm = (throttle.inclination, throttle.arm) if throttle else (0.0, 0.0)
        arm += self.effects.get("thrust_line_offset", {}).get("arm", 0.0)
        sideways = yaw.get("arm", 0.0) + yaw.get("p_factor", 0.0) * alpha
        force = thrust * math.cos(inclination), 0.0, -thrust * math.sin(inclination)
        return force, (thrust * yaw.get("torque_arm", 0.0), thrust * arm, thrust * sideways)

    def _trimmed(self) -> tuple[State, dict[str, float]]:
        """Straight, level flight without sideslip at the reference airspeed: state, and deflections with thrust."""
        speed = self.aircraft.reference.airspeed

        def unpack(z: np.ndarray) -> tuple[State, dict[str, float]]:
            alpha, phi, theta, *given = (float(value) for value in z)
            state = (speed * math.cos(alpha), 0.0, speed * math.sin(alpha), 0, 0, 0, phi, theta, 0.0, self._height)
            return state, dict(zip((*self.controls, "thrust"), given, strict=True))

        def left(z: np.ndarray) -> list[float]:
            state, given = unpack(z)
            self._separation.start(float(z[0]))
            rates, _ = self._rates(state, given, given["thrust"], _STILL, 0.0)
            return [*rates[:6], rates[9]]

        thrust = 0.1 * self.mass * GRAVITY
        found = least_squares(left, [0.08, 0.0, 0.08, *[0.0] * len(self.controls), thrust], xtol=1e-14, ftol=1e-14)
        if np.abs(found.fun).max() > 1e-6:
            raise DivergedError("no trim")
        return unpack(found.x)


def _terms(aircraft: Aircraft, errors: Mapping[str, float]) -> list[list[float]]:
    """Rows CL, CD, CY, Cl, Cm, Cn; columns 1, alpha, beta, p, q, r, then the controls."""
    columns = ("0", "alpha", "beta", "p", "q", "r", *aircraft.control_symbols)
    known = aircraft.derivatives

    def value(name: str) -> float:
        return (known[name].value if name in known else 0.0) + errors.get(name, 0.0)

    return [[value(f"{c}_{x}") for x in columns] for c in ("CL", "CD", "CY", "Cl", "Cm", "Cn")]
