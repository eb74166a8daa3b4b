"""What is handed on; truth: the corrected file, read and flown beside the flight by a simulator of its own."""

import numpy as np
import pytest

from sysid_node.gap.correction import corrected_aircraft
from sysid_node.gap.estimation.predictive_density import Evidence, FlightEvidence
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.validation.simulation_error import simulation_gap
from sysid_node.sim import Simulator


@pytest.mark.slow
def test_the_gap_that_is_stated_is_that_of_the_corrected_file(servos_fitted) -> None:
    """The flight's servo is off the file's within its tolerance: the corrected file still is, and the gap says so."""
    check, (model,) = servos_fitted.check, servos_fitted.models
    of_file = residual_model_of(Simulator(corrected_aircraft(servos_fitted), 50.0), model.flight)
    flight = FlightEvidence.throughout(of_file, of_file.simulator.neutral())
    np.testing.assert_allclose(check.corrected.flights[0].residual, flight.residual, rtol=1e-6, atol=1e-9)
    evidence = Evidence(np.zeros(1), (flight,))
    _, stated = check.stated
    assert stated.after == pytest.approx(simulation_gap(evidence, evidence).before, rel=1e-6)
    assert 1.1 * check.simulation_gap.after < stated.after < stated.before


def test_without_stated_effects_nothing_differs(lagging) -> None:
    assert lagging.check.corrected is lagging.check.final
