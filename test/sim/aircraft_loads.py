"""Loads of an aircraft file by its documented meaning: derivatives, tables (SciPy's interpolation) and thrust."""

import numpy as np
from scipy.interpolate import RegularGridInterpolator

COEFFICIENTS = ("CL", "CD", "CY", "Cl", "Cm", "Cn")


def coefficients(aircraft, x):
    """(N, 6) at columns of regressors by name; rates non-dimensional, V in m/s."""
    size = len(x["alpha"])
    found = {c: np.zeros(size) for c in COEFFICIENTS}
    for name, derivative in aircraft.derivatives.items():
        c, _, regressor = name.partition("_")
        if regressor != "k":
            found[c] += derivative.value * (np.ones(size) if regressor == "0" else x[regressor])
    for table in aircraft.tables:
        held = [np.clip(x[n], p[0], p[-1]) for n, p in zip(table.over, table.points, strict=True)]
        found[table.coefficient] += RegularGridInterpolator(table.points, np.array(table.values))(np.column_stack(held))
    if "CD_k" in aircraft.derivatives:
        found["CD"] += aircraft.derivatives["CD_k"].value * found["CL"] ** 2
    return np.column_stack([found[c] for c in COEFFICIENTS])


def loads(aircraft, x, thrust):
    """Force (N) and moment (N m) about the CG (N, 6), body axes forward-right-down; thrust in N."""
    g, throttle = aircraft.geometry, aircraft.throttle
    CL, CD, CY, Cl, Cm, Cn = coefficients(aircraft, x).T
    scale = 0.5 * aircraft.reference.air_density * x["V"] ** 2 * g.S
    cos, sin = np.cos(x["alpha"]), np.sin(x["alpha"])
    rows = [CL * sin - CD * cos, CY, -CL * cos - CD * sin, g.b * Cl, g.cbar * Cm, g.b * Cn]
    total = np.column_stack([scale * row for row in rows])
    if throttle is not None:
        total[:, 0] += thrust * np.cos(throttle.inclination)
        total[:, 2] -= thrust * np.sin(throttle.inclination)
        total[:, 4] += thrust * throttle.arm
    return total


def motion(aircraft, x):
    """Velocity (N, 3) m/s and rates (N, 3) rad/s, forward-right-down."""
    V, a, b = x["V"], x["alpha"], x["beta"]
    velocity = np.column_stack([V * np.cos(a) * np.cos(b), V * np.sin(b), V * np.sin(a) * np.cos(b)])
    g = aircraft.geometry
    return velocity, np.column_stack([x["p"] * 2 * V / g.b, x["q"] * 2 * V / g.cbar, x["r"] * 2 * V / g.b])


def trimmed(aircraft, level):
    """The level flight as columns of length one: what ``level`` gives, the rest zero."""
    names = ("alpha", "beta", "p", "q", "r", "V", "throttle", *aircraft.control_symbols)
    return {name: np.array([float(level.get(name, 0.0))]) for name in names}


def planes(aircraft, level, count=6):
    """States at the nodes of the tables: every pair of variables moves by itself, others as in level flight."""
    nodes: dict[str, set[float]] = {}
    for table in aircraft.tables:
        for name, points in zip(table.over, table.points, strict=True):
            nodes.setdefault(name, set()).update(points)
    centre = trimmed(aircraft, level)
    rows = []
    names = list(centre)
    random = np.random.default_rng(7)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            for _ in range(count):
                row = {name: value[0] for name, value in centre.items()}
                for name in (first, second):
                    reach = {"p": 0.1, "q": 0.02, "r": 0.1}.get(name, 0.1)
                    known = sorted(nodes.get(name, ()))
                    row[name] = random.choice(known) if known else row[name] + random.uniform(-reach, reach)
                rows.append(row)
    return {name: np.array([row[name] for row in rows]) for name in names}


def scales(aircraft, x):
    """Sizes of a force and of the moments (N, 6), to which an error is related."""
    g = aircraft.geometry
    pressure = 0.5 * aircraft.reference.air_density * x["V"] ** 2 * g.S
    return pressure[:, None] * np.array([1.0, 1.0, 1.0, g.b, g.cbar, g.b])
