"""What the aircraft file's lookup tables add to the coefficients: for single numbers, and for columns of numbers.

The estimators subtract it from the measured coefficients, so that they estimate derivatives on top of the tables. Both
forms perform the same operations in the same order and agree to the last bit. A number is looked up by bisection in
pure Python, which a live program can afford at each sample. ``lookup`` is the form for compiled and differentiated
code.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft, LookupTable
from sysid_node.dynamics.atmosphere import speed_of_sound
from sysid_node.dynamics.coefficients import rate_regressors
from sysid_node.dynamics.vector import Namespace, Real, Triple

Array = NDArray[np.float64]
Lookup = Callable[[Sequence[Any]], Any]
#: From the tables' variables by name to what the tables add to each coefficient that has one.
TableSum = Callable[[Mapping[str, Any]], dict[str, Any]]


def scalar_tables(tables: Sequence[LookupTable]) -> TableSum:
    """Function from the variables as numbers to what the tables add to each coefficient."""
    return _summed(tables, _number)


def array_tables(tables: Sequence[LookupTable]) -> TableSum:
    """As ``scalar_tables`` for columns (N,)."""
    return _summed(tables, _column)


def table_variables(
    flow: Triple, rates: Triple, span: Real, chord: Real, density: Real | None, xp: Namespace
) -> dict[str, Real]:
    """What tables may be over, by name, but for the controls and the throttle.

    ``flow`` airspeed (m/s), alpha and beta (rad); ``rates`` rad/s; ``span`` and ``chord`` m; ``density`` kg/m^3. The
    Mach number is that of the standard temperature at this density, and left out where it is None.
    """
    airspeed, alpha, beta = flow
    p, q, r = rate_regressors(rates, 0.5 / airspeed, span, chord)
    found = {"alpha": alpha, "beta": beta, "V": airspeed, "p": p, "q": q, "r": r}
    return found if density is None else found | {"Mach": mach_number(airspeed, density, xp)}


def mach_number(airspeed: Real, density: Real, xp: Namespace) -> Real:
    """Airspeed (m/s) over the speed of sound in the standard atmosphere where it has this density (kg/m^3)."""
    return airspeed / speed_of_sound(density, xp)


def need_mach(tables: Sequence[LookupTable]) -> bool:
    """Whether a table is over the Mach number."""
    return any("Mach" in table.over for table in tables)


def full_thrust(aircraft: Aircraft) -> float:
    """Thrust (N) at full throttle, by which a thrust is divided for tables over the throttle; inf without one."""
    throttle = aircraft.throttle
    return math.inf if throttle is None or throttle.max_thrust is None else throttle.max_thrust


def _summed(tables: Sequence[LookupTable], form: Callable[[LookupTable], Lookup]) -> TableSum:
    lookups = [(table.coefficient, table.over, form(table)) for table in tables]

    def added(variables: Mapping[str, Any]) -> dict[str, Any]:
        total: dict[str, Any] = {}
        for coefficient, over, look_up in lookups:
            value = look_up([variables[name] for name in over])
            total[coefficient] = total[coefficient] + value if coefficient in total else value
        return total

    return added


def _number(table: LookupTable) -> Lookup:
    points, values = table.points, table.values

    def of_one(at: Sequence[float]) -> float:
        i, share = _interval(points[0], at[0])
        low: Any = values[i]
        return float(low + share * (values[i + 1] - low))

    def of_two(at: Sequence[float]) -> float:
        (i, share), (j, across) = _interval(points[0], at[0]), _interval(points[1], at[1])
        first: Any = values[i]
        second: Any = values[i + 1]
        low = first[j] + across * (first[j + 1] - first[j])
        high = second[j] + across * (second[j + 1] - second[j])
        return float(low + share * (high - low))

    return of_one if len(points) == 1 else of_two


def _interval(points: Sequence[float], x: float) -> tuple[int, float]:
    """The interval between points in which x lies, and the share of it below x; 0 or 1 beyond the ends."""
    i = min(max(bisect_right(points, x) - 1, 0), len(points) - 2)
    share = (x - points[i]) / (points[i + 1] - points[i])
    return i, 0.0 if share < 0.0 else 1.0 if share > 1.0 else share


def _column(table: LookupTable) -> Lookup:
    points, values = [np.array(axis, dtype=float) for axis in table.points], np.array(table.values, dtype=float)

    def of_one(at: Sequence[Array]) -> Array:
        i, share = _intervals(points[0], at[0])
        return np.asarray(values[i] + share * (values[i + 1] - values[i]))

    def of_two(at: Sequence[Array]) -> Array:
        (i, share), (j, across) = _intervals(points[0], at[0]), _intervals(points[1], at[1])
        low = values[i, j] + across * (values[i, j + 1] - values[i, j])
        high = values[i + 1, j] + across * (values[i + 1, j + 1] - values[i + 1, j])
        return np.asarray(low + share * (high - low))

    return of_one if len(points) == 1 else of_two


def _intervals(points: Array, x: Array) -> tuple[NDArray[np.intp], Array]:
    """``_interval`` for a column (N,)."""
    i = np.clip(np.searchsorted(points, x, side="right") - 1, 0, points.size - 2)
    share = (x - points[i]) / (points[i + 1] - points[i])
    return i, np.where(share < 0.0, 0.0, np.where(share > 1.0, 1.0, share))
