"""The same equations for single numbers, NumPy's arrays and JAX's: equal to rounding."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.aircraft.model import Inertia
from sysid_node.dynamics import airflow, attitude, lever_arm, rigid_body, scalar
from sysid_node.dynamics.atmosphere import air_density
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.compiled import xla

xla.configure()

RANDOM = np.random.default_rng(3)
FLOW = np.column_stack([RANDOM.uniform(10.0, 30.0, 50), *RANDOM.uniform(-0.5, 0.5, (2, 50))])
RATES, FORCE, ANGLES, ARM = RANDOM.uniform(-1.4, 1.4, (4, 50, 3))
INERTIA = Inertia(0.3, 0.35, 0.6, 0.02)

#: Name -> function of flow, rates, forces, angles, arm (each three components) and the library.
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "flow": lambda flow, w, f, e, r, xp: airflow.flow_angles(
        lever_arm.velocity_at(airflow.velocity_of(flow, xp), w, r), xp
    ),
    "flow rates": lambda flow, w, f, e, r, xp: airflow.flow_rates(airflow.velocity_of(flow, xp), f, xp),
    "wind axes": lambda flow, w, f, e, r, xp: airflow.wind_axes_rates(flow, w, f, xp),
    "attitude": lambda flow, w, f, e, r, xp: attitude.euler_angles(attitude.quaternion(e, xp), xp),
    "Euler rates": lambda flow, w, f, e, r, xp: attitude.euler_rates(e[0], e[1], w, xp),
    "rotation": lambda flow, w, f, e, r, xp: rigid_body.angular_acceleration(INERTIA, Vector(*w), Vector(*f)),
    "translation": lambda flow, w, f, e, r, xp: rigid_body.velocity_rate(
        Vector(*f), attitude.down_of_euler(e[0], e[1], xp), Vector(*w), airflow.velocity_of(flow, xp)
    ),
    "lever arm": lambda flow, w, f, e, r, xp: lever_arm.specific_force_at(Vector(*f), Vector(*w), Vector(*e), r),
    "density": lambda flow, w, f, e, r, xp: (air_density(100.0 * flow[0], xp),),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_numbers_numpy_and_jax_agree(name: str) -> None:
    function, inputs = FUNCTIONS[name], (FLOW, RATES, FORCE, ANGLES, ARM)
    by_numpy = np.array(function(*(tuple(x.T) for x in inputs), np))
    by_jax = np.array(function(*(tuple(jnp.asarray(x.T)) for x in inputs), jnp))
    by_scalar = np.array([function(*(tuple(x[i].tolist()) for x in inputs), scalar) for i in range(50)]).T
    size = np.maximum(np.abs(by_numpy), np.abs(by_numpy).max(axis=1, keepdims=True))
    assert by_numpy.dtype == by_jax.dtype == np.float64
    assert (np.abs(by_jax - by_numpy) <= 1e-15 * size).all()
    assert (np.abs(by_scalar - by_numpy) <= 1e-15 * size).all()
