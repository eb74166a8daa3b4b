"""Station ``structure``: the vibration of the airframe in one mode."""

from __future__ import annotations

from sysid_node.sim.effects import structural_mode
from sysid_node.sim.model.layout import Scalar, Values


def start(effects: dict[str, Values], load: Scalar) -> tuple[Scalar, Scalar]:
    """Modal displacement (m) and speed (m/s) at rest under a specific force along z (m/s^2)."""
    return structural_mode.steady(effects["structural_mode"], load), 0.0 * load


def rate(effects: dict[str, Values], x: Scalar, v: Scalar, load: Scalar) -> tuple[Scalar, Scalar]:
    """Rates of displacement (m/s) and speed (m/s^2)."""
    return v, structural_mode.acceleration(effects["structural_mode"], x, v, load)


def felt(effects: dict[str, Values], acceleration: Scalar, speed: Scalar) -> tuple[Scalar, Scalar]:
    """Added specific force along z (m/s^2) and pitch rate (rad/s) at the IMU."""
    return structural_mode.felt(effects["structural_mode"], acceleration, speed)
