"""Whether a flight can be diagnosed; an InputError says in one line what is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.live.mean_lift import LiftLimits, lift_agrees, likely_mistakes
from sysid_node.flight.record import Array
from sysid_node.gap.flightdata.gap_flight import GapFlight, travel
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS, Admission


def require_distinct_flights(flights: Sequence[GapFlight], holdouts: Sequence[GapFlight]) -> None:
    """Raises InputError where a held-out flight is one of those that are fitted."""
    for holdout in holdouts:
        for flight in flights:
            a, b = holdout.record, flight.record
            same = a.start_ns == b.start_ns and len(a) == len(b) and np.array_equal(a["az"], b["az"])
            if same or holdout.source == flight.source:
                raise InputError(
                    f"--holdout {holdout.source}: is the same flight as {flight.source}; hold out a flight that is not "
                    "fitted, or leave --holdout away to check on parts of the flight"
                )


def require_admissible(model: ResidualModel, limits: Admission = THRESHOLDS.admission) -> ResidualModel:
    """The model itself. Raises InputError where no surface moves, or where the lift is that of another aircraft."""
    commands = model.commands[:, :-1]
    moved = travel(commands)
    if (moved < limits.least_travel).all():
        raise InputError(
            f"{model.flight.source}: no control surface moves by more than {moved.max():.2g} rad; fly a manoeuvre "
            "(sysid excite designs one)"
        )
    lift, expected = model.series[:, 0].mean(), model.predicted_series(model.simulator.neutral())[:, 0].mean()
    slope = model.simulator.aircraft.derivatives.get("CL_alpha")
    alpha = math.nan if model.flight.inferred else model.record["alpha"].mean()
    lift_limits = LiftLimits(limits.lift_ratio, limits.vane_error, limits.stall_angle)
    if not lift_agrees(lift, expected, alpha, slope.value if slope else 0.0, lift_limits):
        raise InputError(
            f"{model.flight.source}: mean CL is {lift:.2f} by the mass and wing area of "
            f"{model.simulator.aircraft.name!r}, not {expected:.2f} as in its file; {likely_mistakes()}{_or_imu(model)}"
        )
    return model


def _or_imu(model: ResidualModel) -> str:
    """What else may be wrong where the flow angles are inferred."""
    return " Its flow angles are inferred from the IMU: it may be far off, too." if model.flight.inferred else ""


def signal_to_noise(model: ResidualModel) -> Array:
    """Ratio of signal power to the power of the sensors' noise, by channel that was measured."""
    power = (np.abs(model.measured[:, 1:]) ** 2).mean(axis=0).sum(axis=0)
    return np.asarray((power / model.noise[1:].sum(axis=0))[model.axes])
