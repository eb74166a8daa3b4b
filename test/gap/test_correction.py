"""The correction of a diagnosis; truth: what the diagnosis found, and the aircraft file's own format."""

import numpy as np
import pytest

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import parse_aircraft
from sysid_node.gap.correction import corrected_aircraft, effect_options
from sysid_node.gap.document import document
from sysid_node.sim import Simulator


@pytest.mark.slow
def test_causes_are_among_the_effects_of_the_corrected_file(lagging) -> None:
    (cause,) = document(lagging)["causes"]
    lag = corrected_aircraft(lagging).effects["actuator_lag"]
    assert set(lag) == set(cause["parameters"]) == {"elevator", "aileron", "rudder"}
    assert lag["elevator"].value == pytest.approx(0.08, rel=0.15)
    assert lag["elevator"].tolerance == cause["parameters"]["elevator"][1]


@pytest.mark.slow
def test_the_corrected_file_can_be_read_and_is_the_corrected_simulator(lagging) -> None:
    corrected = corrected_aircraft(lagging)
    again = Simulator(parse_aircraft(dump_aircraft(corrected)), 50.0)
    fit = lagging.attribution.corrected
    lag = fit.simulator.names.index("actuator_lag.time_constant")
    assert again.neutral()[lag] == pytest.approx(fit.flights[0].point[lag])
    expected = lagging.aircraft.derivatives["Cm_alpha"].value
    error = fit.flights[0].point[fit.simulator.names.index("derivative_error.Cm_alpha")]
    assert corrected.derivatives["Cm_alpha"].value == pytest.approx(expected + error)


@pytest.mark.slow
def test_effects_that_are_no_causes_stay_as_the_file_states_them(servos_fitted) -> None:
    corrected, file = corrected_aircraft(servos_fitted), servos_fitted.aircraft
    assert corrected.effects == file.effects and corrected.delays == file.delays
    assert corrected.derivatives["Cm_alpha"].value == pytest.approx(file.derivatives["Cm_alpha"].value + 0.015)


@pytest.mark.slow
def test_options_of_the_command_are_the_same_effects(lagging) -> None:
    corrected = Simulator(corrected_aircraft(lagging), 50.0)
    by_options = lagging.attribution.corrected.simulator.vector(effect_options(lagging))
    np.testing.assert_allclose(by_options, corrected.neutral(), rtol=1e-5, atol=1e-12)
