"""Which axes the commands excite: of a flight that hardly moves in pitch, nothing is said about pitch.

In a lateral manoeuvre the aircraft pitches a little, too, by what the pilot holds against and by weather. A large share
of that small motion may be unknown without anything to be concluded from it. So the gap and the verdict are of the
axes that the commands excite; what the others leave is reported, and decides nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import LATERAL
from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS

#: Names of the two motions in gap.json.
MOTIONS = IN_PLANE, SIDEWAYS = "longitudinal", "lateral"

_SIDEWAYS = frozenset({*LATERAL, "ay", "p", "r", "beta", "phi", "psi"})


def excited_motions(models: Sequence[ResidualModel]) -> frozenset[str]:
    """Of ``longitudinal`` and ``lateral`` those that the commands of at least one flight excite.

    A motion counts where the surfaces command a share of the strongest angular acceleration about it, or the thrust a
    longitudinal acceleration that counts. Both count where nothing is commanded at all.
    """
    found: set[str] = set()
    for model in models:
        pitch, side = _commanded(model)
        strongest, limits = max(pitch, side), THRESHOLDS.admission
        found |= {IN_PLANE} if pitch > limits.share_of_command * strongest or _thrust(model) > limits.thrust else set()
        found |= {SIDEWAYS} if side > limits.share_of_command * strongest else set()
    return frozenset(found or MOTIONS)


def quiet_motions(models: Sequence[ResidualModel]) -> list[str]:
    """Of the motions that were measured those that no command excites."""
    measured = MOTIONS if all(model.flight.lateral for model in models) else (IN_PLANE,)
    excited = excited_motions(models)
    return [name for name in measured if name not in excited]


def of_motions(names: Sequence[str], motions: frozenset[str]) -> NDArray[np.bool_]:
    """Which of these channels or readings (N,) belong to one of the motions."""
    return np.array([(SIDEWAYS if name in _SIDEWAYS else IN_PLANE) in motions for name in names])


def excited_channels(models: Sequence[ResidualModel]) -> NDArray[np.bool_]:
    """Which channels (12,) belong to a motion that the commands excite."""
    return of_motions(CHANNELS, excited_motions(models))


def _commanded(model: ResidualModel) -> tuple[float, float]:
    """Angular accelerations (rms about the mean, rad/s^2) in pitch, and in roll or yaw, that the surfaces command."""
    aircraft, record = model.simulator.aircraft, model.record
    pressure = float(np.mean(0.5 * record["rho"] * record["V"] ** 2)) * aircraft.geometry.S
    b, cbar, inertia = aircraft.geometry.b, aircraft.geometry.cbar, aircraft.inertia
    arms = {"Cl": b / inertia.Ixx, "Cm": cbar / inertia.Iyy, "Cn": b / inertia.Izz}
    commands = model.commands[:, :-1] - model.commands[:, :-1].mean(axis=0)
    sizes = {}
    for coefficient, arm in arms.items():
        known = (aircraft.derivatives.get(f"{coefficient}_{symbol}") for symbol in aircraft.control_symbols)
        slopes: Array = np.array([derivative.value if derivative else 0.0 for derivative in known])
        sizes[coefficient] = pressure * arm * float(np.sqrt(np.mean((commands @ slopes) ** 2)))
    return sizes["Cm"], max(sizes["Cl"], sizes["Cn"])


def _thrust(model: ResidualModel) -> float:
    """Longitudinal acceleration (rms about the mean, m/s^2) that a measured thrust commands."""
    if model.simulator.aircraft.throttle is None or not model.flight.metered:
        return 0.0
    return float(model.commands[:, -1].std()) / model.simulator.aircraft.mass
