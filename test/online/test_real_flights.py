"""Real flights. Truth: what the field's own programs give for the same regressions (references.py of the bench)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.estimation.real import aircraft, attas, hfb320, references, thor, twin_otter
from bench.estimation.real.ordinary import estimated, ordinary
from bench.estimation.real.replaying import replay
from bench.estimation.real.showing import errors_off


@pytest.fixture(scope="module")
def otter(flights):
    return twin_otter.flown(flights)


def test_twin_otter_rates_are_sidpacs(otter):
    found = twin_otter.rates(otter, twin_otter.GRID)
    for name, reference in references.TWIN_OTTER_RATES.items():
        assert abs(errors_off(found[name], reference)) < 1.0, name


def test_the_reference_is_understood(otter):
    """Plain sums and independent lines give SIDPAC's own numbers, standard errors included."""
    found = twin_otter.textbook(otter, twin_otter.GRID)
    for name, reference in references.TWIN_OTTER_RATES.items():
        assert found[name].value == pytest.approx(reference.value, abs=0.02 * reference.error + 5e-4), name
        assert found[name].error == pytest.approx(reference.error, rel=0.01), name


def test_standard_errors_do_not_depend_on_the_density_of_the_grid(otter):
    fine, coarse = (twin_otter.rates(otter, (0.3, step, 1.3)) for step in (0.01, 0.04))
    textbook = [twin_otter.textbook(otter, (0.3, step, 1.3)) for step in (0.01, 0.04)]
    for name in references.TWIN_OTTER_RATES:
        assert fine[name].error == pytest.approx(coarse[name].error, rel=0.1), name
        assert textbook[0][name].error < 0.65 * textbook[1][name].error, name


def test_twin_otter_coefficients_are_sidpacs(otter, flights):
    known = aircraft.twin_otter(flights)
    found = {**replay(otter, known, frequencies=twin_otter.GRID).derivatives, **twin_otter.vertical_force(otter, known)}
    for name, reference in references.TWIN_OTTER_COEFFICIENTS.items():
        assert abs(errors_off(found[name], reference)) < 1.0, name


@pytest.mark.slow
def test_attas_is_that_of_the_frequency_transform_regression(flights):
    boom, known = attas.at_boom(attas.flown(flights)), aircraft.attas(flights)
    regressed = attas.rates(boom)
    replayed = attas.dimensional(replay(boom, known, frequencies=attas.GRID).derivatives, boom, known)
    for name, reference in references.ATTAS.items():
        assert abs(errors_off(regressed[name], reference)) < 2.0, name
        assert abs(errors_off(replayed[name], reference)) < 2.0, name


@pytest.mark.slow
def test_hfb320_lift_is_that_of_filter_error_and_not_of_output_error(flights):
    found = replay(hfb320.flown(flights), aircraft.hfb320(flights), frequencies=hfb320.GRID).derivatives["CL_alpha"]
    for reference in (references.HFB_FILTER_ERROR, references.HFB_EKF):
        assert abs(found.value - reference["CL_alpha"].value) < 2.0 * found.error
    assert found.value - references.HFB_OUTPUT_ERROR["CL_alpha"].value > 4.0 * found.error


@pytest.mark.slow
def test_hfb320_damping_hangs_on_when_alpha_was_measured(flights):
    """With the angle of attack 0.1 s earlier, pitch damping and elevator are those of filter error."""
    flight, known = hfb320.flown(flights), aircraft.hfb320(flights)
    early = replay(hfb320.moved(flight, "alpha", 0.1), known, frequencies=hfb320.GRID).derivatives
    for name in ("Cm_q", "Cm_de"):
        assert abs(early[name].value - references.HFB_FILTER_ERROR[name].value) < 2.0 * early[name].error, name


def test_thors_surfaces_follow_their_commands_late(flights):
    flight = thor.flown(flights)
    for command, rate in (("da", "p"), ("de", "q")):
        size, lag = thor.correlation(flight, command, rate)
        assert size < -0.5
        assert 0.03 <= lag <= 0.07
    # the rudder's command follows the yawing that it is meant to damp: nothing is learnt of the rudder
    size, lag = thor.correlation(flight, "dr", "r")
    assert size > 0.5
    assert lag < 0.0


@pytest.mark.slow
def test_thors_roll_by_least_squares_is_not_surely_wrong(flights):
    """By a file of 15 derivatives with wide tolerances. Truth: the University of Minnesota's simulator of it.

    Without what the bands of frequencies tell, `Cl_p` is valid with -0.11 and a standard error of 0.09.
    """
    published = aircraft.thor(flights)
    kept = "CL_0 CL_alpha CL_de CD_0 CD_alpha Cm_0 Cm_alpha Cm_q Cm_de CY_beta Cl_beta Cl_p Cl_da Cn_beta Cn_dr"
    wide = {n: replace(d, tolerance=0.4 * abs(d.value)) for n, d in published.derivatives.items() if n in kept.split()}
    found = estimated(thor.flown(flights), replace(ordinary(published), derivatives=wide), "commands", method="sls_rft")
    for name in ("Cl_p", "Cl_da"):
        d = found.estimates.derivatives[name]
        assert d.lower < published.derivatives[name].value < d.upper
        assert not d.valid


def test_regression_in_dimensional_form_finds_what_made_the_signals():
    time = np.cumsum(np.random.default_rng(1).uniform(0.015, 0.025, 1500))
    u, w = np.sin(2 * np.pi * 0.4 * time), np.sin(2 * np.pi * 0.9 * time + 1.0)
    found = twin_otter.regress(time, {"A": 2.0 * u - 3.0 * w + 5.0}, {"u": u, "w": w}, (0.1, 0.04, 1.5))
    assert found["A_u"].value == pytest.approx(2.0, abs=1e-9)
    assert found["A_w"].value == pytest.approx(-3.0, abs=1e-9)
