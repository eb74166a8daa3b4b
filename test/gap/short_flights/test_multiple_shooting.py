"""Short simulated flights; truth: a flight of this simulator itself."""

import numpy as np
import pytest
from gap_flights import interrupted

from sysid_node.errors import InputWarning
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.short_flights.multiple_shooting import course_of, simulate_beside, simulation_error
from sysid_node.sim import Simulator
from sysid_node.sim.model.layout import OUTPUTS

SIZE = 100  # samples at 50 Hz: 2 s
RATES = [OUTPUTS.index(name) for name in "pqr"]


def test_short_flights_begin_at_equal_distances(plain_model) -> None:
    begins = np.asarray(course_of(plain_model, SIZE).begins)
    assert np.flatnonzero(begins)[0] == 0
    assert set(np.diff(np.flatnonzero(begins))) == {SIZE}


def test_the_simulator_reads_what_was_measured_where_a_short_flight_begins(plain_model) -> None:
    course = course_of(plain_model, SIZE)
    heavier = plain_model.simulator.vector({"mass_error": {"error": 0.3}})
    simulated, measured, _ = simulate_beside(plain_model, heavier, course)
    begins = np.asarray(course.begins)[: len(measured)]
    states = [OUTPUTS.index(name) for name in ("p", "q", "r", "phi", "theta", "V")]
    np.testing.assert_allclose(simulated[begins][:, states], measured[begins][:, states], atol=1e-9)


def test_the_true_simulator_departs_by_no_more_than_noise_and_another_by_more(plain_model, aircraft) -> None:
    course = course_of(plain_model, SIZE)
    true = simulation_error(plain_model, plain_model.simulator.neutral(), course)
    slow = plain_model.simulator.vector({"actuator_lag": {"time_constant": 0.15}})
    other = simulation_error(plain_model, slow, course)
    assert (true[:, RATES].std(axis=0) < 6.0 * aircraft.noise["gyro"]).all()
    assert (other[:, RATES].std(axis=0) > 3.0 * true[:, RATES].std(axis=0)).all()


def test_still_air_moves_by_the_noise_of_the_air_data_alone(plain_model, aircraft) -> None:
    _, _, air = simulate_beside(plain_model, plain_model.simulator.neutral(), course_of(plain_model, SIZE))
    across = plain_model.record["V"].mean() * aircraft.noise["alpha"]
    assert air.shape == (len(plain_model.record), 3)
    assert air[:, 2].std() < 3.0 * across


@pytest.mark.parametrize("angle", ["phi", "psi"])
def test_errors_of_angles_are_within_half_a_turn(plain_model, angle) -> None:
    error = simulation_error(plain_model, plain_model.simulator.neutral(), course_of(plain_model, SIZE))
    assert np.abs(error[:, OUTPUTS.index(angle)]).max() <= np.pi


def test_a_rate_limit_of_the_true_size_fits_best(make_flight, plain_model) -> None:
    """The servos are driven by commands before the low-pass: with smoothed steps a limit 8 % smaller would fit best."""
    model = residual_model_of(plain_model.simulator, make_flight({"actuator_rate_limit": {"rate": 0.4}}, seed=4))
    course = course_of(model, SIZE)
    slower, true, faster = (
        simulation_error(model, model.simulator.vector({"actuator_rate_limit": {"rate": rate}}), course)[:, RATES[0]]
        for rate in (0.36, 0.4, 0.44)
    )
    assert true.std() < 0.6 * min(slower.std(), faster.std())


def test_a_surface_that_fails_in_a_later_part_of_a_recording_fails_there(aircraft, make_flight) -> None:
    """Truth: the onset flown, which counts from the recording's beginning; 7 s later most of the part is without it."""
    flown = {"control_effectiveness_loss": {"elevator": 0.5, "onset": 12.0}}
    with pytest.warns(InputWarning, match="interrupted once"):
        part = interrupted(aircraft, make_flight(flown, seed=15), 9.0, 10.0)[1]
    model = residual_model_of(Simulator(aircraft, 50.0), part)
    course, pitch = course_of(model, 100), OUTPUTS.index("q")
    right, late = (
        simulation_error(model, model.simulator.vector({"control_effectiveness_loss": loss}), course)
        for loss in ({"elevator": 0.5, "onset": 12.0}, {"elevator": 0.5, "onset": 19.0})
    )
    assert right[:, pitch].std() < 0.5 * late[:, pitch].std()
