"""What arrives at the controller is bounded: dropped or clipped, counted, and forgotten as soon as it ends."""

import math

import numpy as np
import pytest
from flying import AIRCRAFT, LEVEL, NAN, beliefs, level
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid_node.control import controller
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import ErrorCorrelation, Measurements, SetPoints
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.flying import live

STEP = 0.02  # s
ANY = st.floats(allow_nan=True, allow_infinity=True)
LIMITS = np.array([control.limit for control in AIRCRAFT.controls.values()])


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(excitation=st.tuples(ANY, ANY, ANY), sensed=st.tuples(*[ANY] * 9))
def test_after_nonsense_the_command_is_soon_that_of_level_flight(
    excitation: tuple[float, ...], sensed: tuple[float, ...]
) -> None:
    """Whatever a fifth of a second of input holds, a second later nothing of it is left but what was integrated."""
    state = controller.init(AIRCRAFT, ControllerSettings())
    trim = controller.step(state, level(0.0), SetPoints())
    for k in range(1, 10):
        command = controller.step(state, Measurements(k * STEP, *sensed), SetPoints(), excitation)
        assert np.isfinite(command).all()
        assert (np.abs(command[:3]) <= LIMITS + 1e-12).all()
        assert (np.abs(state.law.surfaces.by_feedback) <= 2.0 * LIMITS).all(), (
            "a surface cannot carry more than it can move"
        )
    for k in range(10, 60):
        command = controller.step(state, level(k * STEP), SetPoints())
    np.testing.assert_allclose(command[:3], trim[:3], atol=0.12)


@pytest.mark.slow
def test_an_aircraft_survives_any_excitation() -> None:
    """3 s of it on all surfaces: before the bound it ended at NaN."""
    simulator = Simulator(AIRCRAFT, 100.0)
    trim = trim_flight(simulator)
    flight = live.start(simulator, trim, live.LiveConditions(noise=0.0), live.vector(simulator, []))
    state, command, rows = controller.init(AIRCRAFT, ControllerSettings()), trim.command.tolist(), []
    for k in range(650):
        now = live.step(simulator, flight, command)
        _, _, _, p, q, r, phi, theta, _, V, alpha, beta = now.outputs.tolist()
        sensed = Measurements(now.time, p, q, r, phi, theta, V, alpha, beta, now.density)
        command = controller.step(state, sensed, SetPoints(), (1e308, -1e308, 1e308) if 100 <= k < 400 else (0.0,) * 3)
        rows.append((phi, theta - LEVEL))
    assert np.abs(rows).max() < 0.6
    assert np.abs(rows[-1]).max() < 0.05
    assert state.checks.counts["excitation clipped"] == 300


def test_excitation_is_clipped_to_the_setting_and_dropped_where_it_is_not_finite() -> None:
    state = controller.init(AIRCRAFT, ControllerSettings(largest_excitation=0.05))
    trim = controller.step(state, level(0.0), SetPoints())
    moved = controller.step(state, level(STEP), SetPoints(), (0.01, 9.0, 0.0))
    assert moved.elevator - trim.elevator == pytest.approx(0.01, abs=1e-4)
    for k in range(2, 12):
        moved = controller.step(state, level(k * STEP), SetPoints(), (0.0, 9.0, 0.0))
    assert moved.aileron == pytest.approx(0.05, abs=0.01)
    controller.step(state, level(12 * STEP), SetPoints(), (0.0, NAN, 0.0))
    assert state.checks.counts == {"excitation clipped": 11, "excitation not finite, dropped": 1}


def test_implausible_measurements_count_as_not_measured() -> None:
    state = controller.init(AIRCRAFT, ControllerSettings())
    controller.receive_estimates(state, 0.0, beliefs())
    controller.step(state, level(0.0), SetPoints())
    controller.step(state, level(STEP, q=1e9), SetPoints())
    assert state.stale == "q not measured"
    assert state.checks.counts == {"q implausible, dropped": 1}


@pytest.mark.parametrize("changes", [{"value": math.inf}, {"value": 1e30}, {"lower": NAN}, {"upper": -1e3}])
def test_estimates_without_a_usable_interval_are_dropped(changes: dict[str, float]) -> None:
    state = controller.init(AIRCRAFT, ControllerSettings())
    for k in range(20):
        controller.receive_estimates(state, k * STEP, beliefs(**changes))
        controller.step(state, level(k * STEP), SetPoints())
    assert [axis.accepted for axis in state.axes] == [0, 0]
    assert state.checks.counts["estimates implausible, dropped"] == 20 * len(AIRCRAFT.derivatives)


@pytest.mark.parametrize(
    ("names", "matrix"),
    [
        (("Cm_de", "Cm_q"), [[1.0, NAN], [NAN, 1.0]]),
        (("Cm_de", "Cm_q"), [[1.0, 1.5], [1.5, 1.0]]),
        (("Cm_de", "Cm_q"), [[1.0, 0.5], [-0.5, 1.0]]),
        (("Cm_de", "Cm_q"), [[0.5, 0.0], [0.0, 1.0]]),
        (("Cm_de", "Cm_q"), [[1.0]]),
        (("Cm_de", "Cm_de"), [[1.0, 0.0], [0.0, 1.0]]),
        (("Cm_de", "Cm_q", "Cm_alpha"), [[1.0, 0.9, 0.9], [0.9, 1.0, -0.9], [0.9, -0.9, 1.0]]),
    ],
    ids=["NaN", "beyond 1", "not symmetric", "diagonal", "size", "a name twice", "negative eigenvalue"],
)
def test_what_is_no_correlation_matrix_is_dropped(names: tuple[str, ...], matrix: list[list[float]]) -> None:
    state = controller.init(AIRCRAFT, ControllerSettings())
    controller.receive_correlation(state, ErrorCorrelation(("Cm_de", "Cm_q"), np.eye(2)))
    assert state.correlation is not None
    controller.receive_correlation(state, ErrorCorrelation(names, np.array(matrix)))
    assert state.correlation is None
    assert state.checks.counts == {"correlation implausible, dropped": 1}
