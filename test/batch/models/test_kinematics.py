"""The sensor-error model: without errors it gives the flight again, and each error acts on its own output."""

import numpy as np
import pytest
from made_flight import KESTREL, clean

from sysid_node.batch.likelihood import rollout
from sysid_node.batch.models.kinematics import STATES, sensor_errors
from sysid_node.batch.models.manoeuvres import manoeuvre_data, with_forces_at_cg

OUTPUTS = ("V", "alpha", "beta", "phi", "theta")


@pytest.fixture(scope="module")
def case():
    model = sensor_errors(OUTPUTS, KESTREL.sensors.air_data)
    record = with_forces_at_cg(KESTREL, clean())
    start = dict.fromkeys(STATES, 0.0) | {"V": KESTREL.reference.airspeed}
    start |= {name: float(record["theta"][0]) for name in ("alpha", "theta")}
    return model, manoeuvre_data(model, record, start)


def test_without_errors_the_integrated_imu_is_the_measured_motion(case):
    model, data = case
    found = rollout.outputs(model, data, model.start)
    for column, name in enumerate(OUTPUTS):
        error = found[:, column] - data.outputs[:, column]
        assert np.abs(error).max() < 0.02 * np.ptp(data.outputs[:, column]), name


def test_errors_of_the_air_data_act_on_their_outputs_alone(case):
    model, data = case
    theta = dict(zip(model.names, model.start, strict=True)) | {"bias_alpha": 0.02, "scale_V": 0.1}
    plain = rollout.outputs(model, data, model.start)
    found = rollout.outputs(model, data, np.array(list(theta.values())))
    np.testing.assert_allclose(found[:, 0], 1.1 * plain[:, 0], rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], plain[:, 1] + 0.02, rtol=1e-9)
    np.testing.assert_allclose(found[:, 2:], plain[:, 2:], rtol=1e-12)


def test_only_errors_of_what_is_measured_are_estimated():
    assert "bias_beta" not in sensor_errors(("V", "alpha")).names
    assert {"bias_ax", "bias_q", "scale_V"} <= set(sensor_errors(("V", "alpha")).names)
