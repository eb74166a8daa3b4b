"""Which axes the commands excite: of a flight that hardly moves in pitch, nothing is said about pitch.

In a lateral manoeuvre the aircraft pitches a little, too, by what the pilot holds against and by weather. A large share
of that small motion may be unknown without anything to be concluded from it. So the gap and the verdict are of the
axes that the commands excite; what the others leave is reported, and decides nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import LATERAL, LATERAL_SIGNALS
from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS

#: Names of the two motions in gap.json.
MOTIONS = IN_PLANE, SIDEWAYS = "longitudinal", "lateral"

_SIDEWAYS = frozenset({*LATERAL, *LATERAL_SIGNALS})


def excited_motions(models: Sequence[ResidualModel]) -> frozenset[str]:
    """Of ``longitudinal`` and ``lateral`` those that the commands of at least one flight excite.

    A motion counts where the surfaces command a share of the strongest angular acceleration of all flights about it, or
    the thrust a longitudinal acceleration that counts. Both count where nothing is commanded at all.
    """
    pitch, side = np.max([_commanded(model) for model in models], axis=0)
    limits = THRESHOLDS.admission
    least = limits.share_of_command * max(pitch, side)
    pushed = any(_thrust(model) > limits.thrust for model in models)
    found = {IN_PLANE} if pitch > least or pushed else set()
    return frozenset(found | ({SIDEWAYS} if side > least else set()) or MOTIONS)


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


def excited_windows(models: Sequence[ResidualModel]) -> float:
    """In how many windows of the spectra of all flights the commands excite the aircraft: the effective number."""
    return effective_number(np.concatenate([commanded_by_window(model) for model in models]))


def effective_number(powers: Array) -> float:
    """The effective number of parts that are excited, from the powers (n, 3) that ``commanded_by_window`` gives them.

    It is the inverse Simpson index of the power, each axis that is excited counted alike (Hill (1973), Ecology 54(2)):
    all parts where the same manoeuvre is in each, two where the only manoeuvre is in two.
    """
    whole = powers.sum(axis=0)
    if not whole.max() > 0.0:
        return float(len(powers))
    counted = whole > THRESHOLDS.admission.share_of_command**2 * whole.max()
    shares = (powers[:, counted] / whole[counted]).mean(axis=1)
    return float(1.0 / np.sum(shares**2))


def commanded_by_window(model: ResidualModel) -> Array:
    """Power (W, 3) of the angular accelerations in roll, pitch and yaw that the surfaces command, by window."""
    spectra = model.windows.transform(np.column_stack(list(_accelerations(model).values())))
    return np.asarray((np.abs(spectra[:, 1:]) ** 2).sum(axis=1))


def _commanded(model: ResidualModel) -> tuple[float, float]:
    """Angular accelerations (rms about the mean, rad/s^2) in pitch, and in roll or yaw, that the surfaces command."""
    sizes = {name: float(np.sqrt(np.mean(series**2))) for name, series in _accelerations(model).items()}
    return sizes["Cm"], max(sizes["Cl"], sizes["Cn"])


def _accelerations(model: ResidualModel) -> dict[str, Array]:
    """Angular accelerations (N,) about the mean, rad/s^2, that the surfaces command, by coefficient of moment."""
    aircraft, record = model.simulator.aircraft, model.record
    pressure = float(np.mean(0.5 * record["rho"] * record["V"] ** 2)) * aircraft.geometry.S
    b, cbar, inertia = aircraft.geometry.b, aircraft.geometry.cbar, aircraft.inertia
    arms = {"Cl": b / inertia.Ixx, "Cm": cbar / inertia.Iyy, "Cn": b / inertia.Izz}
    commands = model.commands[:, :-1] - model.commands[:, :-1].mean(axis=0)
    found = {}
    for coefficient, arm in arms.items():
        known = (aircraft.derivatives.get(f"{coefficient}_{symbol}") for symbol in aircraft.control_symbols)
        slopes: Array = np.array([derivative.value if derivative else 0.0 for derivative in known])
        found[coefficient] = np.asarray(pressure * arm * (commands @ slopes))
    return found


def _thrust(model: ResidualModel) -> float:
    """Longitudinal acceleration (rms about the mean, m/s^2) that a measured thrust commands."""
    if model.simulator.aircraft.throttle is None or not model.flight.metered:
        return 0.0
    return float(model.commands[:, -1].std()) / model.simulator.aircraft.mass
