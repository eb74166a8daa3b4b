"""Coefficients from derivatives, by hand."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from made_flight import KESTREL

from sysid_node.aircraft.model import Derivative, LookupTable
from sysid_node.batch.models.aerodynamics import coefficient_function, derivative_parameters

SIGNALS = {
    name: jnp.array(value) for name, value in (("V", 20.0), ("alpha", 0.1), ("q", 0.5), ("p", 0.4), ("de", 0.02))
}


@pytest.mark.parametrize(("reference_rates", "speed"), [(False, 20.0), (True, KESTREL.reference.airspeed)])
def test_coefficients_are_linear_in_the_derivatives(reference_rates, speed):
    names = ("Cm_0", "Cm_alpha", "Cm_q", "Cm_de", "Cm_V")
    evaluate = coefficient_function(KESTREL, names, reference_rates)
    theta = tuple(jnp.array(v) for v in (0.01, -1.0, -12.0, -1.5, 0.02))
    rate = 0.5 * KESTREL.geometry.cbar / (2.0 * speed)
    expected = 0.01 - 0.1 - 12.0 * rate - 1.5 * 0.02 + 0.02 * 20.0 / KESTREL.reference.airspeed
    np.testing.assert_allclose(evaluate(SIGNALS, theta)["Cm"], expected, rtol=1e-12)


def test_the_drag_polar_is_a_parabola_over_lift():
    evaluate = coefficient_function(KESTREL, ("CL_alpha", "CD_0", "CD_k"), False)
    found = evaluate(SIGNALS, (jnp.array(5.0), jnp.array(0.03), jnp.array(0.05)))
    np.testing.assert_allclose(found["CD"], 0.03 + 0.05 * 0.5**2, rtol=1e-12)


def test_tables_add_to_the_coefficients_and_to_the_lift_of_the_polar():
    """By NumPy's interpolation; half the rate over V, Mach with the speed of sound at sea level (ICAO Doc 7488)."""
    tables = (
        LookupTable("CL", ("alpha",), ((0.0, 0.08, 0.2),), (0.0, 0.04, -0.2)),
        LookupTable("CL", ("V", "q"), ((10.0, 30.0), (-1.0, 1.0)), ((0.0, 0.0), (-0.2, 0.2))),
        LookupTable("CL", ("Mach",), ((0.0, 0.1),), (0.0, 0.5)),
        LookupTable("CL", ("throttle",), ((0.0, 1.0),), (0.0, 0.3)),
        LookupTable("CY", ("alpha",), ((0.0, 1.0),), (0.0, 1.0)),
    )
    evaluate = coefficient_function(dataclasses.replace(KESTREL, tables=tables), ("CL_alpha", "CD_k"), False)
    full = KESTREL.throttle.max_thrust
    found = evaluate(
        {**SIGNALS, "rho": jnp.array(1.225), "thrust": jnp.array(0.2 * full)}, (jnp.array(5.0), jnp.array(0.05))
    )
    rate = 0.5 * KESTREL.geometry.cbar / (2.0 * 20.0)
    lift = 0.5 + 0.04 - 0.24 * 0.02 / 0.12 + 0.5 * 0.2 * rate + 5.0 * 20.0 / 340.294 + 0.3 * 0.2
    np.testing.assert_allclose(found["CL"], lift, rtol=1e-6)
    np.testing.assert_allclose(found["CD"], 0.05 * lift**2, rtol=1e-6)
    assert set(found) == {"CL", "CD"}


def test_parameters_start_at_the_files_values_with_its_tolerances():
    aircraft = dataclasses.replace(KESTREL, derivatives={"Cm_q": Derivative(-12.0, 3.0), "CY_p": Derivative(0.1)})
    (pitch,) = derivative_parameters(aircraft, ("Cm",), use_prior=True)
    assert (pitch.name, pitch.start, pitch.prior) == ("Cm_q", -12.0, (-12.0, 3.0))
    assert derivative_parameters(aircraft, ("CY",), use_prior=True)[0].prior is None
