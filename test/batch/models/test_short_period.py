"""The short-period model against the textbook's equations in flow angles, which it writes in velocities."""

import jax.numpy as jnp
import numpy as np
from made_flight import KESTREL

from sysid_node.batch.models.short_period import INPUTS, short_period

START = {"CZ_alpha": -5.0, "CZ_de": -0.4, "CZ_0": -0.3, "Cm_alpha": -1.0, "Cm_q": -12.0, "Cm_de": -1.2, "Cm_0": 0.01}
INPUT = dict(
    zip(INPUTS, (0.03, 18.0, 0.05, 0.4, -0.2, 0.3, 0.1, -1.5, 1.2, 0.7), strict=True)
)  # de V beta p r phi theta ax rho q_measured
ALPHA, Q, ALPHA0, DE0 = 0.12, 0.6, 0.05, 0.01


def test_the_derivatives_are_those_of_klein_and_morelli():
    """Klein & Morelli (2006), eqs. 3.33 (angle of attack) and 3.34 (pitch rate), worked by hand."""
    model = short_period(KESTREL, START, ALPHA0, DE0)
    found = model.derivative(
        (jnp.array(ALPHA), jnp.array(Q)), tuple(jnp.array(v) for v in INPUT.values()), tuple(model.start)
    )
    s, geometry, inertia = INPUT, KESTREL.geometry, KESTREL.inertia
    force = 0.5 * s["rho"] * s["V"] ** 2 * geometry.S
    CZ = -5.0 * (ALPHA - ALPHA0) - 0.4 * (s["de"] - DE0) - 0.3
    rate = s["q_measured"] * geometry.cbar / (2.0 * s["V"])
    Cm = -1.0 * (ALPHA - ALPHA0) - 12.0 * rate - 1.2 * (s["de"] - DE0) + 0.01
    gx = s["ax"] - 9.80665 * np.sin(s["theta"])
    gz = force * CZ / KESTREL.mass + 9.80665 * np.cos(s["theta"]) * np.cos(s["phi"])
    ca, sa = np.cos(ALPHA), np.sin(ALPHA)
    alpha_rate = Q - (s["p"] * ca + s["r"] * sa) * np.tan(s["beta"])
    alpha_rate += (gz * ca - gx * sa) / (s["V"] * np.cos(s["beta"]))
    moment = force * geometry.cbar * Cm + (inertia.Izz - inertia.Ixx) * s["p"] * s["r"]
    moment += inertia.Ixz * (s["r"] ** 2 - s["p"] ** 2)
    np.testing.assert_allclose(found, (alpha_rate, moment / inertia.Iyy), rtol=1e-12)


def test_the_normal_acceleration_has_a_bias():
    model = short_period(KESTREL, START | {"bias_az": 0.7}, ALPHA, INPUT["de"])
    state = jnp.array(ALPHA), jnp.array(Q)
    outputs = model.output(state, tuple(jnp.array(v) for v in INPUT.values()), tuple(model.start))
    force = 0.5 * INPUT["rho"] * INPUT["V"] ** 2 * KESTREL.geometry.S
    np.testing.assert_allclose(outputs, (ALPHA, Q, force * -0.3 / KESTREL.mass + 0.7), rtol=1e-12)
