"""Station ``structure``: the vibration of the airframe in one mode."""

from __future__ import annotations

from typing import NamedTuple

from sysid_node.sim.effects import structural_mode
from sysid_node.sim.model.layout import Scalar, Values


class Vibration(NamedTuple):
    """The mode at one instant."""

    displacement: Scalar  # m
    speed: Scalar  # m/s
    load: Scalar  # specific force along z, m/s^2


def start(effects: dict[str, Values], load: Scalar) -> Vibration:
    """The mode at rest under a specific force along z (m/s^2)."""
    return Vibration(structural_mode.steady(effects["structural_mode"], load), 0.0 * load, load)


def advance(effects: dict[str, Values], mode: Vibration, load: Scalar, step: Scalar) -> Vibration:
    """The mode one step (s) later, under a specific force (m/s^2) that was linear in time meanwhile."""
    now = structural_mode.advance(effects["structural_mode"], *mode, load, step)
    return Vibration(*now, load)


def acceleration(effects: dict[str, Values], mode: Vibration) -> Scalar:
    """The modal acceleration, m/s^2."""
    return structural_mode.acceleration(effects["structural_mode"], *mode)


def felt(effects: dict[str, Values], acceleration: Scalar, speed: Scalar) -> tuple[Scalar, Scalar]:
    """Added specific force along z (m/s^2) and pitch rate (rad/s) at the IMU."""
    return structural_mode.felt(effects["structural_mode"], acceleration, speed)
