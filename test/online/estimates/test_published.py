"""What is published: intervals, offsets, fits, and a reason wherever an estimate is not to be believed."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import TRUTH, exact_flight, fly, made_aircraft, multisteps
from scipy.stats import t as student

from sysid_node.aircraft.model import Derivative
from sysid_node.online import estimator
from sysid_node.online.estimates.current_solution import current_solution
from sysid_node.online.estimates.published import estimate
from sysid_node.online.estimates.validity import STALE
from sysid_node.online.renewal.pending_renewal import complete
from sysid_node.online.renewal.segment_update import renew
from sysid_node.online.replay import run
from sysid_node.online.settings import METHODS, OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.types import SAMPLE_COLUMNS, DerivativeEstimate

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft()
SLOPES = [name for name in TRUTH if not name.endswith("_0")]


def fed(
    time: Array, samples: Array, settings: OnlineSettings | None = None, aircraft: object = AIRCRAFT
) -> EstimatorState:
    """The state after all samples."""
    state = estimator.init(aircraft, settings or OnlineSettings(method="sls_rft"))
    for t, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, t, sample)
    return state


def assert_sound(derivatives: Mapping[str, DerivativeEstimate]) -> None:
    """Valid means: finite, with an interval about the value, and status ok; not valid: a reason."""
    for name, d in derivatives.items():
        assert d.name == name
        assert d.valid == (d.status == "ok")
        assert d.status
        if d.valid:
            assert math.isfinite(d.value)
            assert d.lower < d.value < d.upper
            assert 0.0 < d.standard_error < math.inf


@pytest.fixture(scope="module")
def flown() -> tuple[Array, Array]:
    """Twenty-five seconds of 3-2-1-1s in light turbulence."""
    time, flights = fly(AIRCRAFT, multisteps(25.0, 100.0), gusts=0.5, closed_loop=False)
    return time, flights[0]


@pytest.mark.parametrize("method", METHODS)
def test_intervals_are_students_about_the_value(method: str, flown: tuple[Array, Array]) -> None:
    found = estimate(fed(*flown, OnlineSettings(method=method)))
    assert found.time == flown[0][-1]
    assert_sound(found.derivatives)
    assert all(found.derivatives[name].valid for name in SLOPES if abs(TRUTH[name]) > 0.05)
    for name, d in found.derivatives.items():
        freedom = found.fits[name.partition("_")[0]].degrees_of_freedom
        half = student.ppf(0.975, freedom) * d.standard_error
        # instruments: further, and not as far on one side as on the other, see test_interval
        assert d.upper - d.value == pytest.approx(half, rel=1e-6 if method == "sls_rft" else 0.25)
        assert d.value - d.lower == pytest.approx(half, rel=1e-6 if method == "sls_rft" else 0.25)
        assert abs(d.value - TRUTH[name]) < 4.5 * d.standard_error, name


def test_fits_tell_how_much_is_explained(flown: tuple[Array, Array]) -> None:
    fits = estimate(fed(*flown)).fits
    assert set(fits) == {"CL", "CD", "CY", "Cl", "Cm", "Cn"}
    for name, fit in fits.items():
        assert fit.coefficient == name
        assert 0.5 < fit.r_squared <= 1.0
        assert fit.residual_std > 0.0
        # two numbers a line and second of band, less the unknowns
        assert 40.0 < fit.degrees_of_freedom < 2 * 48 * 2
        assert fit.samples == pytest.approx(2450, abs=60)


@pytest.mark.parametrize("samples", [1500, 1777, 2500])
def test_between_renewals_estimates_use_every_sample(flown: tuple[Array, Array], samples: int) -> None:
    """``present`` at the last sample against a renewal at that sample: the same least squares."""
    time, rows = flown
    state = fed(time[:samples], rows[:samples])
    renew(state, last=True)
    complete(state)
    now = current_solution(state)
    assert now is not None
    assert state.latest is not None
    np.testing.assert_allclose(now.solution.theta, state.latest.solution.theta, rtol=1e-6, atol=1e-9)


def test_nothing_is_known_before_half_a_second_of_data() -> None:
    time = np.arange(0.0, 0.9, 0.01)
    found = estimate(fed(time, exact_flight(AIRCRAFT, time)))
    assert set(found.derivatives) == set(TRUTH)
    assert all((d.valid, d.status) == (False, "converging") for d in found.derivatives.values())
    assert all(math.isnan(d.value) and d.standard_error == math.inf for d in found.derivatives.values())
    assert found.fits == {}


def test_early_estimates_are_converging_and_intervals_shrink(flown: tuple[Array, Array]) -> None:
    time, samples = flown
    history = run(AIRCRAFT, OnlineSettings(method="sls_rft"), time, samples, np.array([1.2, 5.0, 12.0, 24.0]))
    assert not any(d.valid for d in history[0].derivatives.values())
    for name in ("CL_alpha", "Cm_de", "Cl_p", "Cn_beta"):
        errors = [found.derivatives[name].standard_error for found in history[1:]]
        assert errors == sorted(errors, reverse=True)


def test_a_control_that_does_not_move_is_not_excited(flown: tuple[Array, Array]) -> None:
    """A second flap that stays where it is; least squares without it is singular, or its error without bound."""
    commands = multisteps(15.0, 100.0)
    commands[:, 2] = 0.0
    time, flights = fly(AIRCRAFT, commands, closed_loop=False)
    found = estimate(fed(time, flights[0])).derivatives
    assert_sound(found)
    for name in ("CY_dr", "Cl_dr", "Cn_dr"):
        assert not found[name].valid
        assert found[name].status in ("not excited", "converging")
    assert found["CL_alpha"].valid


def test_no_motion_at_all_is_not_excited() -> None:
    """A steady simulator: what is left of the motion is rounding, and the offsets hold all the slopes' effects."""
    time = np.arange(0.0, 8.0, 0.01)
    samples = np.tile(exact_flight(AIRCRAFT, time[:2])[:1], (time.size, 1))
    found = estimate(fed(time, samples)).derivatives
    assert_sound(found)
    assert {d.status for d in found.values()} <= {"not excited", "converging"}
    assert not any(d.valid for d in found.values())


def test_regressors_that_move_as_one_are_named() -> None:
    """Aileron and rudder geared together, noise aside: Cn_da and Cn_dr cannot be told apart."""
    time = np.arange(0.0, 15.0, 0.01)
    samples = exact_flight(AIRCRAFT, time)
    da, dr = len(SAMPLE_COLUMNS) + 1, len(SAMPLE_COLUMNS) + 2
    samples[:, da] = 0.5 * samples[:, dr]
    samples[:, :9] += np.random.default_rng(0).normal(size=(time.size, 9)) * np.repeat([0.3, 0.02, 0.005], 3)
    samples[:, da] += 1e-5 * np.random.default_rng(1).normal(size=time.size)
    found = estimate(fed(time, samples)).derivatives
    assert_sound(found)
    assert found["Cn_da"].status == "collinear with dr"
    assert found["Cn_dr"].status == "collinear with da"


def test_an_old_sample_makes_all_stale(flown: tuple[Array, Array]) -> None:
    time, samples = flown
    state = fed(time, samples)
    fresh, stale = estimate(state, time[-1] + 0.9 * STALE), estimate(state, time[-1] + 1.1 * STALE)
    assert any(d.valid for d in fresh.derivatives.values())
    assert {d.status for d in stale.derivatives.values()} == {"stale input"}
    assert fresh.derivatives["Cm_de"].value == stale.derivatives["Cm_de"].value


@pytest.mark.parametrize("column", ["V", "q"])
def test_a_column_that_never_comes_is_named(column: str) -> None:
    time = np.arange(0.0, 5.0, 0.01)
    samples = exact_flight(AIRCRAFT, time)
    samples[:, SAMPLE_COLUMNS.index(column)] = np.nan
    found = estimate(fed(time, samples)).derivatives
    assert {d.status for d in found.values()} == {f"{column} not measured"}


def test_a_derivative_believed_to_be_nothing_is_judged_by_its_estimate() -> None:
    """Without value and tolerance there is no size to measure an error against but the estimate's own."""
    unknown = {name: Derivative(0.0) for name in TRUTH}
    aircraft = replace(AIRCRAFT, derivatives=unknown)
    time, flights = fly(AIRCRAFT, multisteps(25.0, 100.0), closed_loop=False)
    found = estimate(fed(time, flights[0], aircraft=aircraft)).derivatives
    assert_sound(found)
    for name in ("CL_alpha", "Cm_de", "Cl_p", "Cn_dr"):
        assert found[name].valid
        assert found[name].standard_error < 0.3 * abs(found[name].value)


def test_estimating_changes_nothing(flown: tuple[Array, Array]) -> None:
    time, samples = flown
    quiet, asked = (estimator.init(AIRCRAFT, OnlineSettings()) for _ in range(2))
    for t, sample in zip(time[:1200].tolist(), samples.tolist(), strict=False):
        estimator.update(quiet, t, sample)
        estimator.update(asked, t, sample)
        estimate(asked)
    assert repr(estimate(quiet)) == repr(estimate(asked)) == repr(estimate(asked))
