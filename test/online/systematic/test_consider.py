"""Imperfections estimated along with the derivatives, on simulated flights of an aircraft whose file is right.

Truth: the plant of ``test/online/plant.py``, which has no imperfection.
"""

from __future__ import annotations

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.systematic.estimation import SystematicErrors
from test.online.plant import fly, made_aircraft, multisteps

SECONDS, RATE = 30.0, 50.0


def flown(tolerances: dict[str, float]) -> tuple[Aircraft, SystematicErrors]:
    """What the estimator finds of an aircraft with these tolerances, in gusts."""
    plant = made_aircraft()
    time, samples = fly(plant, multisteps(SECONDS, RATE), RATE, seed=7, gusts=0.5)
    aircraft = made_aircraft(stated_tolerances=tolerances)
    state = estimator.init(aircraft, OnlineSettings())
    for moment, sample in zip(time.tolist(), samples[0].tolist(), strict=True):
        estimator.update(state, moment, sample)
    assert state.latest is not None and state.latest.systematic is not None
    return aircraft, state.latest.systematic


def test_noise_is_not_explained_by_what_makes_all_coefficients_smaller():
    """A larger area makes all coefficients smaller, and their noise: no flight tells of it, and none may move it."""
    aircraft, found = flown({"geometry.S": 0.01 * 0.55})
    sigma = aircraft.tolerances["geometry.S"]
    assert abs(found.considered.estimate[0]) < 0.05 * sigma
    assert np.sqrt(found.considered.covariance[0, 0]) > 0.99 * sigma


def test_a_relative_error_of_the_area_is_that_of_every_slope():
    """C = F / (qbar S): the exact derivative of a slope with respect to S is -C / S."""
    aircraft, found = flown({"geometry.S": 0.01 * 0.55})
    expected = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    slopes = np.sqrt(found.variance[:, :-1]) / (aircraft.tolerances["geometry.S"] / aircraft.geometry.S)
    assert np.isclose(slopes, abs(expected["CL_alpha"]), rtol=0.1).any()
    assert np.isclose(slopes, abs(expected["Cm_de"]), rtol=0.1).any()
