"""Figures of merit on signals whose figures are known."""

import numpy as np
import pytest

from sysid_node.batch.results.response import ModelResponse
from sysid_node.batch.results.validation import figures_of_merit

TIME = np.arange(2000) / 50.0
SIGNAL = 80.0 + np.sin(2 * np.pi * 0.5 * TIME)


def of(modelled, measured=SIGNAL, **inputs):
    response = ModelResponse("flight", TIME, ("V",), measured[:, None], np.broadcast_to(modelled, TIME.shape)[:, None])
    return figures_of_merit(response, inputs)["V"]


def test_an_exact_answer():
    exact = of(SIGNAL, de=SIGNAL)
    assert exact == {
        "normalised_error": 0.0,
        "theil": 0.0,
        "r_squared": 1.0,
        "whiteness": 1.0,
        "input_correlation": 0.0,
    }


def test_a_constant_answer_is_worth_nothing_however_large_the_constant():
    constant = of(SIGNAL.mean())
    assert constant["normalised_error"] == pytest.approx(1.0)
    assert constant["theil"] == pytest.approx(1.0)
    assert constant["r_squared"] == pytest.approx(0.0)


def test_known_shares():
    half = of(80.0 + 0.5 * (SIGNAL - 80.0))
    assert half["normalised_error"] == pytest.approx(0.5)
    assert half["theil"] == pytest.approx(0.5 / 1.5)
    assert half["r_squared"] == pytest.approx(0.75)


def test_white_residuals_are_white_and_coloured_ones_are_not():
    rng = np.random.default_rng(1)
    white = 0.1 * rng.normal(size=2000)
    assert of(SIGNAL, SIGNAL + white)["whiteness"] == pytest.approx(0.95, abs=0.04)
    assert of(SIGNAL, SIGNAL + np.cumsum(white))["whiteness"] < 0.3


def test_an_input_that_the_residual_follows_is_found_at_its_delay():
    rng = np.random.default_rng(2)
    de, other = rng.normal(size=(2, 2000))
    late = np.roll(de, 25)
    late[:25] = 0.0
    found = of(SIGNAL, SIGNAL + 0.1 * late + 0.02 * rng.normal(size=2000), de=de, da=other)
    assert found["input_correlation"] > 0.9
    assert of(SIGNAL, SIGNAL + 0.1 * rng.normal(size=2000), da=other)["input_correlation"] < 0.1


def test_what_was_not_measured_does_not_count():
    measured = SIGNAL.copy()
    measured[::3] = np.nan
    assert of(SIGNAL, measured)["r_squared"] == 1.0


@pytest.mark.parametrize(
    ("measured", "modelled"),
    [(np.full(2000, 3.0), SIGNAL), (np.full(2000, np.nan), SIGNAL), (SIGNAL, np.full(2000, np.nan))],
    ids=["constant", "not measured", "diverged"],
)
def test_what_cannot_be_judged_is_nan(measured, modelled):
    assert all(np.isnan(value) for value in of(modelled, measured, de=SIGNAL).values())
