"""Imperfections estimated along with the derivatives, on simulated flights of an aircraft whose file is right.

Truth: the plant of ``test/online/plant.py``, which has no imperfection.
"""

from __future__ import annotations

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator
from sysid_node.online.renewal.servo_steps import move_servos
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import EstimatorState, completed
from test.online.plant import fly, made_aircraft, multisteps

SECONDS, RATE = 30.0, 50.0


def flown(tolerances: dict[str, float]) -> tuple[Aircraft, EstimatorState]:
    """The estimator after a flight of an aircraft with these tolerances, in gusts."""
    plant = made_aircraft()
    time, samples = fly(plant, multisteps(SECONDS, RATE), RATE, seed=7, gusts=0.5)
    aircraft = made_aircraft(stated_tolerances=tolerances)
    state = estimator.init(aircraft, OnlineSettings())
    for moment, sample in zip(time.tolist(), samples[0].tolist(), strict=True):
        estimator.update(state, moment, sample)
    assert state.latest is not None and state.latest.systematic is not None
    return aircraft, state


def test_noise_is_not_explained_by_what_makes_all_coefficients_smaller():
    """A larger area makes all coefficients smaller, and their noise: no flight tells of it, and none may move it."""
    aircraft, state = flown({"geometry.S": 0.01 * 0.55})
    found, sigma = state.latest.systematic.considered, aircraft.tolerances["geometry.S"]
    assert abs(found.estimate[0]) < 0.05 * sigma
    assert np.sqrt(found.covariance[0, 0]) > 0.99 * sigma


def test_a_relative_error_of_the_area_is_that_of_every_slope():
    """C = F / (qbar S), so that d C_j / dS = -C_j / S exactly, of every slope."""
    aircraft, state = flown({"geometry.S": 0.01 * 0.55})
    found, belongs = state.latest.systematic, state.equations.structure.belongs.T > 0.0
    slopes = state.latest.solution.theta.T + found.correction[:, :-1]
    jacobian = found.considered.jacobian[0, :, :-1]
    np.testing.assert_allclose(jacobian[belongs], -slopes[belongs] / aircraft.geometry.S, rtol=1e-3)


def test_where_servos_go_in_a_gap_is_not_of_the_segment_before_it():
    """The segment ends at the last sample before the gap, whatever comes after it: a servo is still on its way then."""
    aircraft = made_aircraft(stated_tolerances={"actuator_lag.elevator": 0.05})
    time, samples = fly(aircraft, multisteps(SECONDS, RATE), RATE, seed=7)
    count = int(np.flatnonzero(np.abs(np.diff(samples[0][:, -3])) > 0.0)[200])
    ends = []
    for gap in (None, 0.3, 2.0):
        state = estimator.init(aircraft, OnlineSettings(), commanded=True)
        assert state.controls.servos is not None
        completed(move_servos(state, state.controls.servos.moved(np.full(3, 0.05), np.zeros(3))))
        for moment, sample in zip(time[:count].tolist(), samples[0][:count].tolist(), strict=True):
            estimator.update(state, moment, sample)
        if gap is None:
            estimator.interrupt(state)
        else:
            estimator.update(state, float(time[count - 1]) + gap, (samples[0][count] + 0.0).tolist())
        ends.append(state.finished.information.grams)
    assert np.array_equal(ends[0], ends[1])
    assert np.array_equal(ends[0], ends[2])
