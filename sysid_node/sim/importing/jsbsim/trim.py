"""Steady, straight and level flight in JSBSim; of a glider, a steady glide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.errors import InputError
from sysid_node.sim.importing.jsbsim.program import Flight, Program
from sysid_node.sim.importing.jsbsim.surfaces import JsbsimSurface, properties_at

Array = NDArray[np.float64]

#: Largest remaining acceleration of a trim, m/s^2; of angular acceleration a tenth, rad/s^2.
_BALANCED = 0.02


@dataclass(frozen=True)
class SteadyFlight:
    """The steady flight: its state and each control's deflection, rad."""

    state: Flight
    deflections: dict[str, float]


def find_trim(program: Program, surfaces: Sequence[JsbsimSurface], state: Flight) -> SteadyFlight | None:
    """The steady flight at the state's airspeed and altitude; None where there is none."""
    powered = program.powered
    names = ["alpha", "phi", "theta", *(s.name for s in surfaces), *(["throttle"] if powered else [])]
    bounds = {"alpha": (-0.3, 0.4), "phi": (-0.3, 0.3), "theta": (-0.6, 0.5), "throttle": (0.0, 1.0)}
    bounds |= {s.name: (float(s.deflection[0]), float(s.deflection[-1])) for s in surfaces}
    best = None
    for alpha, throttle in ((0.04, 0.5), (0.1, 0.9), (0.0, 0.3)):
        start = np.array([{"alpha": alpha, "theta": alpha, "throttle": throttle}.get(n, 0.0) for n in names])
        found = _solve(program, surfaces, state, names, start, bounds)
        if best is None or found.cost < best.cost:
            best = found
        if np.abs(best.fun).max() < _BALANCED:
            break
    assert best is not None
    if np.abs(best.fun).max() >= _BALANCED:
        return None
    at = dict(zip(names, (float(x) for x in best.x), strict=True))
    return SteadyFlight(_state(state, at), {s.name: at[s.name] for s in surfaces})


def default_airspeeds(program: Program, state: Flight) -> list[float]:
    """Airspeeds (m/s) to try where none is given: those at which level flight takes a lift coefficient of 0.4, ..."""
    area, _, _ = program.geometry
    program.put(replace(state, airspeed=50.0), {})
    density = program.loads().density
    if not density > 0.0:
        raise InputError(f"air of {density:g} kg/m^3: no airspeed is enough; give another --altitude")
    return [float(np.sqrt(2.0 * program.mass * GRAVITY / (density * area * lift))) for lift in (0.4, 0.25, 0.6, 0.15)]


def one_of(airspeeds: Sequence[float]) -> str:
    """Airspeeds that were tried, in words, without their unit."""
    *first, last = (f"{speed:.0f}" for speed in sorted(airspeeds))
    return f"{', '.join(first)} or {last}" if first else last


def _state(state: Flight, at: dict[str, float]) -> Flight:
    return replace(
        state, alpha=at["alpha"], phi=at["phi"], theta=at["theta"], throttle=at.get("throttle", state.throttle)
    )


def _solve(  # type: ignore[no-untyped-def]
    program: Program,
    surfaces: Sequence[JsbsimSurface],
    state: Flight,
    names: list[str],
    start: Array,
    bounds: dict[str, tuple[float, float]],
):
    """SciPy's result of the balance."""
    lower, upper = np.array([bounds[n] for n in names]).T
    level = ["throttle"] if "throttle" in names else []

    def residual(z: Array) -> Array:
        at = dict(zip(names, (float(x) for x in z), strict=True))
        program.put(_state(state, at), properties_at(surfaces, at))
        moving = program.accelerations()
        moving[3:] *= 10.0
        return np.array([*moving, *(program.climb for _ in level)])

    # an engine's steady thrust is found by iteration: too small a step of the throttle would show its tolerance
    steps = np.array([0.02 if name == "throttle" else 1e-3 for name in names])

    def slopes(z: Array) -> Array:
        columns = []
        for i, step in enumerate(steps):
            other = z.copy()
            other[i] += step if z[i] + step < upper[i] else -step
            columns.append((residual(other) - residual(z)) / (other[i] - z[i]))
        return np.column_stack(columns)

    inside = np.clip(start, lower + 1e-6, upper - 1e-6)
    scale = np.full(len(names), 0.1)
    return least_squares(residual, inside, slopes, bounds=(lower, upper), x_scale=scale, max_nfev=40)


def no_trim(name: str, airspeeds: Sequence[float]) -> InputError:
    """The error of a model without steady flight at any of these airspeeds."""
    return InputError(
        f"JSBSim's {name!r} has no steady level flight at {one_of(airspeeds)} m/s that its elevator, aileron, rudder "
        "and throttle can hold; give another --airspeed or --altitude"
    )
