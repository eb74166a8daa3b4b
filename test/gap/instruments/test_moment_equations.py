"""Moment equations; truth: the sum of squares that they stand for, written out."""

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised, step_limits, unfitted
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.instruments.gust_free_signals import command_instruments
from sysid_node.gap.instruments.moment_equations import limited_step, moment_equations, prior_terms


@pytest.fixture(scope="module")
def fit(aircraft, plain_model) -> CandidateFit:
    return linearised(unfitted([plain_model], nuisances_of(aircraft, plain_model)))


def sum_of_squares(fit: CandidateFit, step: np.ndarray, *, whole: bool) -> float:
    """Of the projected residual, of the means and of the priors, after a step of the unknowns."""
    precision, offset = prior_terms(fit)
    total = float(precision @ (offset + step) ** 2)
    (flight,) = fit.flights
    parts = (flight.rows - flight.slopes @ step).reshape(flight.rows.shape[0], -1, 12)
    total += float(np.sum(parts[:, 0] ** 2))
    rest = parts.copy()
    rest[:, [0, parts.shape[1] // 2]] = 0.0
    (moments,) = moment_equations(fit, fit.powers, command_instruments).flights
    for axis, directions in moments.basis.items():
        if not whole or axis < 6:
            total += float(np.sum((directions.T @ rest[:, :, axis].ravel()) ** 2))
    return total + (float(np.sum(rest[:, :, 6:] ** 2)) if whole else 0.0)


@pytest.mark.parametrize("whole", [False, True])
def test_they_are_the_quadratic_form_of_what_the_instruments_see(fit: CandidateFit, whole: bool) -> None:
    seen = moment_equations(fit, fit.powers, command_instruments, whole=whole)
    least, greatest = step_limits(fit)
    for seed in range(3):
        step = 0.1 * (greatest - least) * np.random.default_rng(seed).standard_normal(least.size)
        quadratic = seen.constant - 2.0 * seen.right @ step + step @ seen.information @ step
        assert quadratic == pytest.approx(sum_of_squares(fit, step, whole=whole), rel=1e-9)


def test_directions_are_orthonormal_and_leave_out_the_means(fit: CandidateFit) -> None:
    (moments,) = moment_equations(fit, fit.powers, command_instruments).flights
    assert set(moments.basis) == set(range(12))
    windows, lines = moments.rows.shape[0], moments.rows.shape[1] // 2
    for directions in moments.basis.values():
        np.testing.assert_allclose(directions.T @ directions, np.eye(directions.shape[1]), atol=1e-9)
        table = directions.reshape(windows, 2 * lines, -1)
        np.testing.assert_allclose(table[:, [0, lines]], 0.0, atol=1e-12)


def test_stronger_noise_counts_less(fit: CandidateFit) -> None:
    """With twice the amplitude of the noise everywhere, a quarter of the information beside the priors' is left."""
    louder = tuple(4.0 * power for power in fit.powers)
    plain, weak = (moment_equations(fit, powers, command_instruments) for powers in (fit.powers, louder))
    np.testing.assert_allclose(weak.information - fit.prior_information,
                               0.25 * (plain.information - fit.prior_information),
                               atol=1e-9 * np.abs(plain.information).max())  # fmt: skip


def test_the_limited_step_is_within_the_limits_and_the_best_there(fit: CandidateFit) -> None:
    seen = moment_equations(fit, fit.powers, command_instruments)
    step, (least, greatest) = limited_step(seen, fit), step_limits(fit)
    room = 1e-5 * (greatest - least)
    assert ((least - room <= step) & (step <= greatest + room)).all()
    gradient = seen.right - seen.information @ step
    free = (least + room < step) & (step < greatest - room)
    worth = gradient[free] ** 2 / np.diag(seen.information)[free]
    assert worth.max(initial=0.0) < 1e-3
