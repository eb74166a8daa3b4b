"""Corrected lines of a stretch against the corrected Gram matrix, which is made of cross-spectra, and its derivatives.

Where everything is exact there is no correction.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from plant import fly, made_aircraft, multisteps

from sysid_node.aircraft.model import UncertainValue
from sysid_node.online import estimator
from sysid_node.online.changes.score_test import ReferenceEstimates
from sysid_node.online.renewal.segment_information import measure_segment
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import EstimatorState, completed, current_lines
from sysid_node.online.systematic.corrected_lines import CorrectedLines, LineCorrection
from sysid_node.online.systematic.corrected_signals import corrected_signals

RATE, SECONDS = 100.0, 14.0
EXACT = made_aircraft()
EFFECTS = {
    "air_data_lag": {"time_constant": UncertainValue(0.06, 0.01)},
    "actuator_lag": {name: UncertainValue(0.05, 0.02) for name in EXACT.controls},
}
AIRCRAFT = replace(EXACT, ideal=False, effects=EFFECTS)


@cache
def flown(ideal: bool = False) -> EstimatorState:
    """After one segment that has not ended, with a file that is off in lags and states many tolerances."""
    time, flights = fly(EXACT, multisteps(SECONDS, RATE), RATE, 1)
    state = estimator.init(EXACT if ideal else AIRCRAFT, OnlineSettings(actuators="auto"))
    for moment, sample in zip(time.tolist(), flights[0].tolist(), strict=True):
        estimator.update(state, moment, sample)
    estimator.complete(state)
    return state


def known(state: EstimatorState) -> tuple[LineCorrection, ReferenceEstimates]:
    """The last corrected estimates, with what is taken out of the lines by now."""
    reference = state.changes.monitor.references[-1].corrected
    assert reference is not None
    assert reference.correction is not None
    return reference.correction, reference


def corrected(state: EstimatorState, correction: LineCorrection, theta: np.ndarray) -> CorrectedLines:
    ends = state.segment.start, state.transform.last
    omega, _ = state.model.spectrum.omega, None
    _, reference = known(state)
    return correction.correct(current_lines(state), state.controls.line_model, omega, ends, reference.equations, theta)


def test_lines_have_the_gram_matrix_that_follows_from_cross_spectra():
    state = flown()
    correction, reference = known(state)
    assert np.abs(correction.estimate).max() > 0.0
    model, total = state.model, measure_segment(state, current_lines(state))
    signals = completed(
        corrected_signals(
            correction.imperfect,
            model.spectrum,
            model.instrument_model,
            correction.servos,
            total,
            correction.estimate,
            (total.energy, correction.changes),
        )
    )
    expected = signals.information.grams.sum(axis=0)
    lines = corrected(state, correction, reference.solution.theta).lines
    found = lines.T @ lines
    scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    used = np.unique([*reference.equations.columns, *reference.equations.outputs])
    at = np.ix_(used, used)
    np.testing.assert_allclose(found[at] / scale[at], expected[at] / scale[at], atol=1e-9)


@pytest.mark.parametrize("key", ["air_data_lag.time_constant", "vane_scale.alpha", "actuator_lag.elevator", "mass"])
def test_errors_are_those_of_residuals_when_an_imperfection_is_another(key):
    """Finite differences, with slopes that move as the imperfection has them move."""
    state = flown()
    correction, reference = known(state)
    i, step = correction.imperfect.keys.index(key), 1e-4
    one = np.zeros_like(correction.covariance)
    one[i, i] = step**2
    S, theta = reference.equations.structure, reference.solution.theta
    equations = reference.equations
    plain = replace(correction, estimate=np.zeros_like(correction.estimate), covariance=one)
    errors = corrected(state, plain, theta).errors[:, :, -1]  # the largest eigenvalue is the last

    def residuals(by: float) -> np.ndarray:
        estimate = np.zeros_like(correction.estimate)
        estimate[i] = by
        lines = corrected(state, replace(plain, estimate=estimate), theta).lines
        moved = theta + by * correction.jacobian[i].T * S.belongs
        return (lines[:, equations.outputs] - lines[:, equations.columns] @ moved).T

    difference = (residuals(step) - residuals(-step)) / 2.0
    sign = np.sign((difference * errors).sum())
    np.testing.assert_allclose(sign * errors, difference, atol=1e-3 * np.abs(difference).max())


def test_without_tolerances_nothing_is_corrected():
    assert flown(True).changes.monitor.references[-1].corrected is None
