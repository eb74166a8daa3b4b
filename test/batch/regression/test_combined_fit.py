"""The regressions of several coefficients as one fit."""

import dataclasses

import numpy as np
from made_flight import KESTREL, clean

from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.linear_regression import regress
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.batch.regression.regressors import regressor_matrix


def regressions(flights, structure):
    return {
        coefficient: regress(
            [f"{coefficient}_{name}" for name in names],
            [f.coefficients[coefficient] for f in flights],
            [regressor_matrix(f, names) for f in flights],
        )
        for coefficient, names in structure.items()
    }


def test_estimates_covariances_and_responses_are_put_together():
    flights = [measured_coefficients(KESTREL, record) for record in (clean(), clean(turn=-1))]
    parts = regressions(flights, {"Cm": ("0", "alpha", "q", "de"), "CY": ("beta", "dr")})
    fit = combined_fit("equation_error", parts, flights)
    assert list(fit.estimates) == ["Cm_0", "Cm_alpha", "Cm_q", "Cm_de", "CY_beta", "CY_dr"]
    np.testing.assert_array_equal(fit.covariance[:4, :4], parts["Cm"].covariance)
    np.testing.assert_array_equal(fit.covariance[4:, 4:], parts["CY"].covariance)
    assert not fit.covariance[:4, 4:].any()
    assert [response.names for response in fit.responses] == [("Cm", "CY")] * 2
    np.testing.assert_array_equal(fit.responses[1].column("CY")[1], parts["CY"].modelled[1])
    np.testing.assert_allclose(fit.log_det, 2.0 * np.log(parts["Cm"].noise * parts["CY"].noise))


def test_a_regressor_within_its_sensors_noise_is_not_valid():
    blind = dataclasses.replace(KESTREL, noise={**KESTREL.noise, "beta": 1.0})
    flown = measured_coefficients(blind, clean())
    fit = combined_fit("equation_error", regressions([flown], {"CY": ("beta", "r")}), [flown])
    assert fit.estimates["CY_beta"].status == "not excited: its regressor is within the sensor's noise"
    assert fit.estimates["CY_r"].valid
