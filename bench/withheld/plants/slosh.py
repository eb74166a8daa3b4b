"""Fuel that sloshes sideways and fore and aft: a mass on a spring, felt as force and moment. On nobody's list."""

from __future__ import annotations

from collections.abc import Mapping

from bench.withheld.plants.motion import Triple


class Slosh:
    """A mass on a spring in the x-y plane of the body, at the centre of gravity; nothing where ``share`` is zero.

    Abramson (1966), "The Dynamic Behavior of Liquids in Moving Containers", NASA SP-106: the first mode as a spring and
    a mass. ``share`` of the aircraft's mass, ``frequency`` Hz, ``damping`` ratio, ``height`` m above the CG.
    """

    def __init__(self, values: Mapping[str, float], mass: float) -> None:
        self._mass = mass * values.get("share", 0.0)
        self._omega = 6.283185307179586 * values.get("frequency", 1.0)
        self._damping, self._height = values.get("damping", 0.05), values.get("height", 0.0)
        self.start()

    def start(self) -> None:
        """At rest."""
        self._place, self._speed, self._pressing = [0.0, 0.0], [0.0, 0.0], (0.0, 0.0, 0.0)

    def advance(self, force: Triple, step: float) -> None:
        """One step (s) on under the specific force (m/s^2) of the tank: semi-implicit Euler."""
        if not self._mass:
            return
        for i in range(2):
            pull = -(self._omega**2) * self._place[i] - 2.0 * self._damping * self._omega * self._speed[i]
            self._speed[i] += step * (pull - force[i])
            self._place[i] += step * self._speed[i]
        self._pressing = force

    def load(self) -> tuple[Triple, Triple]:
        """Force (N) and moment (N m) on the body, beyond those of the same mass at rest."""
        if not self._mass:
            return (0.0,) * 3, (0.0,) * 3
        x, y = self._place
        fx, fy = (
            self._mass * (self._omega**2 * d + 2.0 * self._damping * self._omega * v + f)
            for d, v, f in zip(self._place, self._speed, self._pressing[:2], strict=True)
        )
        weight = -self._mass * self._pressing[2]  # what it presses down with, off the centre line
        return (fx, fy, 0.0), (self._height * fy + y * weight, -self._height * fx - x * weight, 0.0)
