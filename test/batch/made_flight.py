"""A flight of the kestrel with known derivatives: open loop from trim, a 3-2-1-1 on each surface in turn."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
from made_models import multistep
from scipy.optimize import fsolve

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.likelihood import rollout
from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.rigid_body import OUTPUTS, STATES, rigid_body
from sysid_node.flight.record import FlightRecord

#: All but noise is exact in these flights, and the file says so.
KESTREL: Aircraft = dataclasses.replace(
    load_aircraft("kestrel"), ideal=True, noise_bias=dict.fromkeys(("accel", "gyro", "alpha", "beta", "airspeed"), 0.0)
)
TRUTH = {name: derivative.value for name, derivative in KESTREL.derivatives.items()}
MODEL = rigid_body(KESTREL, tuple(STATES), tuple(name for name in OUTPUTS if not name.endswith("dot")))
_NOISE = {
    **dict.fromkeys(("ax", "ay", "az"), "accel"),
    **dict.fromkeys("pqr", "gyro"),
    **dict.fromkeys(("phi", "theta"), "attitude"),
    **{"V": "airspeed", "alpha": "alpha", "beta": "beta"},
}


@cache
def trim() -> tuple[float, float, float, float]:
    """Angle of attack, elevator, thrust and drag's share of level flight at the reference airspeed; rad, N."""
    reference = KESTREL.reference
    pressure = 0.5 * reference.air_density * reference.airspeed**2 * KESTREL.geometry.S
    weight = KESTREL.mass * 9.80665

    def unbalanced(x):
        alpha, de, thrust = x
        lift = pressure * (TRUTH["CL_0"] + TRUTH["CL_alpha"] * alpha + TRUTH["CL_de"] * de)
        drag = pressure * (TRUTH["CD_0"] + TRUTH["CD_alpha"] * alpha + TRUTH["CD_de"] * de)
        pitch = TRUTH["Cm_0"] + TRUTH["Cm_alpha"] * alpha + TRUTH["Cm_de"] * de
        return lift + thrust * np.sin(alpha) - weight, thrust * np.cos(alpha) - drag, pitch

    alpha, de, thrust = fsolve(unbalanced, (0.05, 0.0, 2.0))
    return float(alpha), float(de), float(thrust), float(pressure)


@cache
def clean(seconds: float = 12.0, rate: float = 100.0, turn: int = 1) -> FlightRecord:
    """Without noise; ``turn`` -1 flies the mirror image, for a second flight."""
    alpha, de, thrust, _ = trim()
    time = np.arange(int(seconds * rate)) / rate
    columns = {
        "de": de + turn * multistep(time, 0.5, 0.2, 0.06),
        "da": turn * multistep(time, 3.5, 0.2, 0.08),
        "dr": turn * multistep(time, 6.5, 0.25, 0.10),
        "thrust": np.full(time.size, thrust),
        "rho": np.full(time.size, KESTREL.reference.air_density),
    }
    start = {"V": KESTREL.reference.airspeed, "alpha": alpha, "theta": alpha}
    state = np.array([start.get(name, 0.0) for name in MODEL.states])
    inputs = np.column_stack([columns[name] for name in MODEL.inputs])
    blank = ManoeuvreData(time, inputs, np.zeros((time.size, len(MODEL.outputs))), state)
    outputs = rollout.outputs(MODEL, blank, MODEL.start)
    return FlightRecord(time, columns | dict(zip(MODEL.outputs, outputs.T, strict=True)), f"kestrel {turn:+d}")


def flight(seed: int, scale: float = 1.0, **kwargs: float) -> FlightRecord:
    """With the sensors' noise times ``scale``."""
    record, rng = clean(**kwargs), np.random.default_rng(seed)  # type: ignore[arg-type]
    columns = dict(record.columns)
    for name, kind in _NOISE.items():
        columns[name] = columns[name] + scale * KESTREL.noise[kind] * rng.normal(size=len(record))
    return FlightRecord(record.time, columns, f"{record.name} #{seed}")


def scores(estimates) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Errors in standard errors."""
    return np.array([(e.value - TRUTH[name]) / e.standard_error for name, e in estimates.items() if name in TRUTH])


#: Derivatives that 3-2-1-1s on all surfaces determine well.
WATCHED = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "CY_beta", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr")

#: Largest error of unfiltered equation error: differentiation smears the kinks that stepped inputs leave in the rates.
KINKS = 0.08


def largest_error(fit) -> float:  # type: ignore[no-untyped-def]
    """The largest error of the watched derivatives, as a share of the truth."""
    return max(abs(fit.values[name] / TRUTH[name] - 1.0) for name in WATCHED)
