"""An autopilot of plain rate and attitude feedback with instruments of its own, at a rate of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bench.withheld.plants.motion import Instant, flow_angles
from sysid_node.aircraft.model import Aircraft

RATE = 100.0  # Hz
_SHARE = 0.5  # of a surface's travel that feedback may use
_THRUST = 0.35  # 1/s, per unit of mass, of airspeed


class Pilot:
    """Holds trim attitude and airspeed about the planned commands; ``bandwidth`` rad/s of its attitude loops.

    ``smoothing`` is the time constant (s) of the low-pass filter of its airspeed.
    """

    def __init__(
        self,
        aircraft: Aircraft,
        trim: Mapping[str, float],
        start: Instant,
        bandwidth: float,
        random: np.random.Generator,
        highest: float,
        smoothing: float = 0.0,
    ) -> None:
        self._trim, self._random, self._mass, self._highest = trim, random, aircraft.mass, highest
        self._limits = {n: c.limit or 0.5 for n, c in aircraft.controls.items()}
        self._hold = (start.euler[0], start.euler[1], flow_angles(start.flow)[0])
        self._gains = _gains(aircraft, bandwidth)
        self._speed, self._share = 0.0, 1.0 / (1.0 + smoothing * RATE)
        self._wound = {"elevator": 0.0, "aileron": 0.0}

    def command(self, planned: Mapping[str, float], seen: Instant) -> dict[str, float]:
        """Trim, what is planned from trim, and feedback on what its own instruments see."""
        noise = self._random.standard_normal(6)
        phi = seen.euler[0] - self._hold[0] + 0.003 * noise[0]
        theta = seen.euler[1] - self._hold[1] + 0.003 * noise[1]
        p, q, r = (rate + 0.002 * n for rate, n in zip(seen.rates, noise[2:5], strict=True))
        speed = flow_angles(seen.flow)[0] - self._hold[2] + 0.2 * noise[5]
        errors = {"elevator": (theta, q), "aileron": (phi, p), "rudder": (0.0, r)}
        given = {}
        for name, (angle, rate) in errors.items():
            on_angle, on_rate = self._gains[name]
            wanted = on_angle * (angle + self._wound.get(name, 0.0)) + on_rate * rate
            reach = _SHARE * self._limits[name]
            if name in self._wound and abs(wanted) < reach:
                self._wound[name] += 0.3 * angle / RATE
            limit = self._limits[name]
            total = self._trim[name] + planned[name] + min(max(wanted, -reach), reach)
            given[name] = min(max(total, -limit), limit)
        self._speed += self._share * (speed - self._speed)
        thrust = self._trim["thrust"] + planned["thrust"] - _THRUST * self._mass * self._speed
        given["thrust"] = min(max(thrust, 0.0), self._highest)
        return given


def _gains(aircraft: Aircraft, bandwidth: float) -> dict[str, tuple[float, float]]:
    """Surface for each rad of attitude and each rad/s of rate, from the aircraft's steady responses."""

    def value(name: str) -> float:
        return aircraft.derivatives[name].value

    reference, geometry = aircraft.reference, aircraft.geometry
    alpha = value("Cm_de") / abs(value("Cm_alpha"))
    lift = value("CL_alpha") * alpha + value("CL_de")
    pitch = 0.5 * reference.air_density * reference.airspeed * geometry.S / aircraft.mass * lift
    roll = -value("Cl_da") / value("Cl_p") * 2.0 * reference.airspeed / geometry.b
    yaw = value("Cn_r") / value("Cn_dr") * geometry.b / (2.0 * reference.airspeed)
    return {
        "elevator": (-bandwidth / pitch, -0.2 * bandwidth / pitch),
        "aileron": (-bandwidth / roll, -0.05 * bandwidth / roll),
        "rudder": (0.0, yaw),
    }
