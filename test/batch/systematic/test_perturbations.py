"""Flights with another value of what is taken as known.

Truth: what all consistent estimators agree on, since the derivatives absorb it (the online estimator's sensitivities,
which are tested against finite differences), and equation error on the changed flight.
"""

from dataclasses import replace

import numpy as np
import pytest
from made_flight import KESTREL, flight

from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.settings import BatchSettings
from sysid_node.batch.systematic.flight_posterior import flight_posterior
from sysid_node.batch.systematic.online_passes import online_passes
from sysid_node.batch.systematic.perturbations import perturbed
from sysid_node.batch.systematic.sensitivities import RegressionResponse

RECORD = flight(1)
#: A small step of each, and a derivative that it moves by a share of its size.
ABSORBED = {
    "mass": (0.01 * KESTREL.mass, "CL_alpha"),
    "inertia.Iyy": (0.01 * KESTREL.inertia.Iyy, "Cm_de"),
    "geometry.S": (0.01 * KESTREL.geometry.S, "Cm_de"),
    "vane_scale.alpha": (0.01, "Cm_alpha"),
    "imu_scale.q": (0.01, "Cm_de"),
    "airspeed_scale.error": (0.01, "CL_alpha"),
    "air_density": (0.01, "CL_alpha"),
    "controls.elevator.scale": (0.01, "Cm_de"),
}
FIT = equation_error(KESTREL, [RECORD])
RESPONSE = RegressionResponse(KESTREL, [RECORD], FIT.values, 3.0)


def response_to(key: str, step: float) -> dict[str, float]:
    """By derivative the change of equation error's estimates per unit."""
    changed = perturbed(KESTREL, RECORD, key, step)
    assert changed is not None
    aircraft, record = changed
    return dict(zip(FIT.values, RESPONSE([record], aircraft) / step, strict=True))


def test_what_the_derivatives_absorb_moves_all_estimators_alike():
    file = replace(KESTREL, stated_tolerances={key: step for key, (step, _) in ABSORBED.items()})
    posterior = flight_posterior(online_passes(file, [RECORD], BatchSettings(actuators="positions")))
    assert posterior is not None
    keys = [one.key for one in posterior.imperfections]
    for key, (step, name) in ABSORBED.items():
        online = posterior.jacobian[keys.index(key), posterior.names.index(name)]
        assert response_to(key, step)[name] == pytest.approx(online, rel=0.15), key


@pytest.mark.parametrize(("key", "step"), [("imu_misalignment.roll", 0.01), ("sensors.imu.z", 0.02)])
def test_a_regression_answers_in_its_own_way(key, step):
    """Against equation error on the changed flight, and another answer than the online estimator's."""
    changed = perturbed(KESTREL, RECORD, key, step)
    assert changed is not None
    aircraft, record = changed
    other, found = equation_error(aircraft, [record]), response_to(key, step)
    names = [name for name in FIT.values if name.startswith("CY_")]
    expected = np.array([(other.values[name] - FIT.values[name]) / step for name in names])
    np.testing.assert_allclose([found[name] for name in names], expected, atol=0.1 * np.abs(expected).max())


def test_other_quantities_are_left_to_the_online_estimator():
    assert perturbed(KESTREL, RECORD, "cg_shift.x", 0.01) is None
    assert perturbed(KESTREL, RECORD, "throttle.max_thrust", 1.0) is None
