"""A manoeuvre, as deflections from trim over time, and the limits of the controls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError

Array = NDArray[np.float64]

#: The throttle is flown like a surface, in its own unit: share of full throttle, or N.
THROTTLE = "throttle"


@dataclass(frozen=True)
class Manoeuvre:
    """A sampled manoeuvre: ``time`` (N,) s from zero, uniform; ``deflections`` control -> (N,), rad from trim
    (throttle: its own unit).

    Every control that the aircraft has is a key, in the aircraft's order, the throttle last; zero where not moved.
    """

    time: Array
    deflections: Mapping[str, Array]
    spec: str
    source: str = ""  # the spec as the user wrote it; empty where nobody did

    @property
    def name(self) -> str:
        """What messages call it: the user's own words where there are any."""
        return self.source or self.spec

    @property
    def duration(self) -> float:
        """The time from the first to the last sample, s."""
        return float(self.time[-1])

    @property
    def moved(self) -> tuple[str, ...]:
        """The controls that move."""
        return tuple(name for name, values in self.deflections.items() if np.any(values))

    def surfaces(self) -> Array:
        """Deflections (N, M) of the aerodynamic controls, in the aircraft's order."""
        return np.column_stack([values for name, values in self.deflections.items() if name != THROTTLE])


def control_limits(aircraft: Aircraft) -> dict[str, float]:
    """The largest deflection of every control, infinite where the aircraft file gives none."""
    limits = {name: control.limit or np.inf for name, control in aircraft.controls.items()}
    if aircraft.throttle is not None:
        limits[THROTTLE] = 1.0 if aircraft.throttle.max_thrust is not None else np.inf
    return limits


def check_thrust(manoeuvre: Manoeuvre, aircraft: Aircraft, thrust: Array) -> None:
    """Raise InputError where a commanded thrust (N,), N, trim included, passes the throttle's limits; in its own unit.

    The throttle is never clipped, because the manoeuvre would be another one.
    """
    throttle = aircraft.throttle
    if throttle is None:
        return
    share = thrust / (throttle.max_thrust or 1.0)
    high = 1.0 if throttle.max_thrust else np.inf
    beyond = np.maximum(-share, share - high)
    worst = int(beyond.argmax())
    if beyond[worst] > 1e-9:
        raise InputError(
            f"manoeuvre {manoeuvre.name!r}: trim included, {THROTTLE} reaches {share[worst]:.4g} at "
            f"{manoeuvre.time[worst]:.2f} s, but {aircraft.name} allows 0 to {high:g}; lower the amplitude"
        )


def check_limits(manoeuvre: Manoeuvre, aircraft: Aircraft) -> None:
    """Raises InputError, naming control, time and limit, where a deflection from trim passes the control's limit."""
    for name, limit in control_limits(aircraft).items():
        size = np.abs(manoeuvre.deflections[name])
        worst, unit = int(size.argmax()), "" if name == THROTTLE else " rad"
        if size[worst] > limit * (1 + 1e-9):
            raise InputError(
                f"manoeuvre {manoeuvre.name!r}: {name} moves {size[worst]:.4g}{unit} from trim at "
                f"{manoeuvre.time[worst]:.2f} s, but {aircraft.name}'s limit is {limit:g}{unit}; lower the amplitude"
            )
