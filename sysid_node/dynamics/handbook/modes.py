"""The natural modes of motion: eigenvalues of the equations of motion about steady, level flight.

Short period, phugoid, Dutch roll, roll and spiral: Stevens, Lewis & Johnson (2016), "Aircraft Control and Simulation",
sec. 3.7 and 4.2. Thrust and controls are held.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sysid_node.dynamics.handbook.equations import STATES, Array, Equations
from sysid_node.dynamics.handbook.trim import LevelTrim, pitch_control

LONGITUDINAL, LATERAL = ("V", "alpha", "q", "theta"), ("beta", "p", "r", "phi")


@dataclass(frozen=True)
class Mode:
    """One mode of motion: an oscillation, or two or one real eigenvalues (1/s)."""

    name: str
    eigenvalue: complex  # of a pair, the one with the imaginary part above zero

    @property
    def frequency(self) -> float:
        """Undamped natural frequency (rad/s); of a mode without oscillation NaN."""
        return abs(self.eigenvalue) if self.eigenvalue.imag else math.nan

    @property
    def damping(self) -> float:
        """Damping ratio; of a mode without oscillation NaN."""
        return -self.eigenvalue.real / abs(self.eigenvalue) if self.eigenvalue.imag else math.nan

    @property
    def stable(self) -> bool:
        """Whether it dies away."""
        return self.eigenvalue.real < 0.0

    @property
    def time_to_half(self) -> float:
        """Time (s) to half the amplitude, or to double where it is not stable; infinite where it stays."""
        return math.log(2.0) / abs(self.eigenvalue.real) if self.eigenvalue.real else math.inf


def state_matrix(equations: Equations, trim: LevelTrim) -> Array:
    """A (8, 8) of d(state)/dt = A state, states ``equations.STATES``, by central differences about level flight."""
    at = np.zeros(len(STATES))
    at[:4] = trim.airspeed, trim.alpha, 0.0, trim.alpha
    symbol = pitch_control(equations)
    controls: Mapping[str, float] = {symbol: trim.elevator} if symbol else {}
    columns = []
    for i in range(len(STATES)):
        step = np.zeros(len(STATES))
        step[i] = 1e-4
        pair = [equations.rates(at + side * step, controls, trim.thrust) for side in (1.0, -1.0)]
        columns.append((pair[0] - pair[1]) / 2e-4)
    return np.column_stack(columns)


def modes(equations: Equations, trim: LevelTrim) -> tuple[Mode, ...]:
    """The modes about level flight; those that need a moment of inertia that is not known are left out."""
    A, inertia = state_matrix(equations, trim), equations.aircraft.inertia
    found: list[Mode] = []
    if not math.isnan(inertia.Iyy) and _is_longitudinal(equations):
        found += _longitudinal(_eigenvalues(A, LONGITUDINAL))
    if not math.isnan(inertia.Ixx + inertia.Izz) and _is_lateral(equations):
        found += _lateral(_eigenvalues(A, LATERAL))
    return tuple(found)


def _is_longitudinal(equations: Equations) -> bool:
    return "Cm" in equations.aircraft.model_structure or any(t.coefficient == "Cm" for t in equations.aircraft.tables)


def _is_lateral(equations: Equations) -> bool:
    stated = {*equations.aircraft.model_structure, *(table.coefficient for table in equations.aircraft.tables)}
    return {"Cl", "Cn"} <= stated


def _eigenvalues(A: Array, names: tuple[str, ...]) -> list[complex]:
    """Eigenvalues of a part of the motion, the fastest first; of each pair one."""
    places = [STATES.index(name) for name in names]
    values = [complex(v) for v in np.linalg.eigvals(A[np.ix_(places, places)])]
    values = [complex(v.real, 0.0) if abs(v.imag) < 1e-9 * (1.0 + abs(v)) else v for v in values]
    return sorted((v for v in values if v.imag >= 0.0), key=abs, reverse=True)


def _longitudinal(values: list[complex]) -> list[Mode]:
    """The fast pair is the short period, the slow pair the phugoid; a pair may have become two real eigenvalues."""
    fast: list[complex] = []
    while values and sum(2 if v.imag else 1 for v in fast) < 2:
        fast.append(values.pop(0))
    return [*_named("short period", fast), *_named("phugoid", values)]


def _lateral(values: list[complex]) -> list[Mode]:
    """An oscillation is the Dutch roll; of the real eigenvalues the fast one is the roll, the slow one the spiral."""
    pairs, real = [v for v in values if v.imag], [v for v in values if not v.imag]
    if len(pairs) == 1 and len(real) == 2:
        return [Mode("Dutch roll", pairs[0]), Mode("roll", real[0]), Mode("spiral", real[1])]
    if len(pairs) == 2:
        return [Mode("Dutch roll", pairs[0]), Mode("roll and spiral, coupled", pairs[1])]
    return [Mode(f"lateral, real ({i + 1})", value) for i, value in enumerate(values)]


def _named(name: str, values: list[complex]) -> list[Mode]:
    if len(values) == 1:
        return [Mode(name, values[0])]
    return [Mode(f"{name}, real ({i + 1})", value) for i, value in enumerate(values)]
