"""A small, stable aircraft of known derivatives, and manoeuvres written out."""

import numpy as np

from sysid_node.aircraft.model import (
    Aircraft,
    Control,
    Derivative,
    Geometry,
    Inertia,
    ReferenceCondition,
    Sensors,
    Throttle,
)

DERIVATIVES = {
    "CL_0": 0.02, "CL_alpha": 4.2, "CL_q": 5.0, "CL_de": 0.5,
    "CD_0": 0.03, "CD_alpha": 0.15, "CD_q": 0.1, "CD_de": 0.02,
    "Cm_0": 0.03, "Cm_alpha": -0.6, "Cm_q": -9.0, "Cm_de": -0.9,
    "CY_beta": -0.35, "CY_p": 0.05, "CY_r": 0.2, "CY_da": 0.02, "CY_dr": 0.15,
    "Cl_beta": -0.06, "Cl_p": -0.42, "Cl_r": 0.1, "Cl_da": -0.2, "Cl_dr": 0.008,
    "Cn_beta": 0.07, "Cn_p": -0.03, "Cn_r": -0.09, "Cn_da": 0.01, "Cn_dr": -0.07,
}  # fmt: skip


def make_aircraft(derivatives: dict[str, float] | None = None, **changes: object) -> Aircraft:
    """A 4 kg UAV of ordinary proportions."""
    values = DERIVATIVES if derivatives is None else derivatives
    surfaces = {"elevator": "de", "aileron": "da", "rudder": "dr"}
    fields: dict[str, object] = {
        "name": "test",
        "source": "made up for tests",
        "mass": 4.0,
        "inertia": Inertia(0.3, 0.35, 0.6, 0.02),
        "geometry": Geometry(0.5, 1.8, 0.28),
        "reference": ReferenceCondition(18.0, 1.2),
        "controls": {name: Control(name, symbol, {name: 1.0}, limit=0.4) for name, symbol in surfaces.items()},
        "derivatives": {name: Derivative(value, 0.1 * abs(value) + 0.01) for name, value in values.items()},
        "throttle": Throttle("throttle", 30.0),
        "sensors": Sensors((0.05, 0.0, -0.02), (0.4, 0.05, 0.0)),
        **changes,
    }
    return Aircraft(**fields)  # type: ignore[arg-type]


def steps(time: np.ndarray, start: float, amplitude: float, width: float = 0.3) -> np.ndarray:
    """A 3-2-1-1 (N,)."""
    edges = start + width * np.array([0.0, 3.0, 5.0, 6.0, 7.0])
    level = np.array([0.0, 1.0, -1.0, 1.0, -1.0, 0.0])
    return amplitude * level[np.searchsorted(edges, time + 1e-9, side="right")]


def three_axes(samples: int, step: float) -> np.ndarray:
    """Deflections (N, 4): a 3-2-1-1 on each surface in turn, and a change of thrust."""
    time = np.arange(samples) * step
    columns = [steps(time, 0.2, 0.05), steps(time, 0.7, 0.06), steps(time, 1.2, 0.1), 2.0 * (time > 0.5)]
    return np.column_stack(columns)
