"""How far intervals may shrink where deflections may answer to gusts."""

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import made_aircraft

from sysid_node.online.frequency.regression_signals import layout
from sysid_node.online.regression import gust_correlation, normal_equations
from sysid_node.online.regression.gust_correlation import ALLOWED, ANSWERED
from sysid_node.online.regression.heteroskedasticity import EXCESS_RATIO, NoiseMoments
from sysid_node.online.regression.least_squares import Solution, Uncertainty

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft()


def spread(density: Array, freedom: float) -> Uncertainty:
    """Of as many coefficients as densities."""
    return Uncertainty(np.zeros((density.size, 1, 1)), density, density[:, None], np.full(density.size, freedom))


def inflation(of: Uncertainty, sensed: Array) -> Array:
    return gust_correlation.inflation(of, gust_correlation.share_of_gusts(of.density, sensed), np.zeros(1))


def test_sensor_noise_alone_is_no_reason_for_doubt() -> None:
    noise = np.array([1.0, 2.0])
    np.testing.assert_allclose(inflation(spread(EXCESS_RATIO * noise, 1e4), noise), 1.0)


@pytest.mark.slow
def test_gusts_correlated_as_much_as_allowed_are_covered_whatever_the_length() -> None:
    """Slope of y = u + n where n is correlated with u by ALLOWED: 95 % intervals of 4000 records, short and long."""
    rng = np.random.default_rng(1)
    for length, least in ((100, 0.93), (1000, 0.91), (10000, 0.91)):
        u = rng.normal(size=(4000, length)).astype(np.float32)
        means = np.einsum("ij,ij->i", u, rng.normal(size=u.shape).astype(np.float32)) / length
        errors = means + ALLOWED  # n = ALLOWED u + an independent part
        factor = inflation(spread(np.ones(1), float(length)), np.zeros(1))[0]
        inside = np.abs(errors) < 1.96 * np.sqrt(factor / length)
        assert inside.mean() > least
        if length == 10000:
            assert (np.abs(errors) < 1.96 / np.sqrt(length)).mean() < 0.01  # and not without the allowance


def test_the_sensors_part_of_a_residual_is_their_noise() -> None:
    """The gyro's noise differentiated, and the accelerometer's, against noise passed through the coefficients."""
    plan = normal_equations.normal_equations({"CL": ("alpha",), "Cm": ("alpha",)}, signals := layout(AIRCRAFT, ()))
    still = Solution(np.zeros((1, 2)), np.zeros((1, 1)), np.zeros(2), np.zeros(2), np.array(True))
    omega, step = np.array([3.0, 4.0, 5.0]), 0.01
    nothing = np.zeros((signals.width, signals.width))
    lift, pitch = gust_correlation.sensed(AIRCRAFT, plan, still, nothing, NoiseMoments(), step, omega)
    reference, g = AIRCRAFT.reference, AIRCRAFT.geometry
    qS = 0.5 * reference.air_density * reference.airspeed**2 * g.S
    assert lift == pytest.approx(step * (AIRCRAFT.noise["accel"] * AIRCRAFT.mass / qS) ** 2)
    turning = AIRCRAFT.noise["gyro"] * AIRCRAFT.inertia.Iyy / (qS * g.cbar)
    assert pitch == pytest.approx(step * turning**2 * (9.0 + 16.0 + 25.0) / 3.0)


def correlation(moved: float, left: float, gusts: float = 1.0) -> Array:
    """That of CL, Cm and Cl, where the deflections' pitching moment has the energy ``moved``.

    Gusts leave ``left`` of CL and of Cm, and a hundredth of the deflections' energy of Cl.
    """
    signals = layout(AIRCRAFT, ())
    regressors = {"CL": ("alpha", "de"), "Cm": ("alpha", "de"), "Cl": ("p", "da")}
    plan = normal_equations.normal_equations(regressors, signals)
    theta = np.array([[5.0, -0.6, 0.0], [0.3, -0.5, 0.0], [0.0, 0.0, -0.4], [0.0, 0.0, 0.2]])
    left_of_each = np.array([left, left, 0.01])
    solution = Solution(theta, np.zeros((4, 4)), left_of_each, left_of_each, np.array(True))
    gram = np.diag(np.full(signals.width, 1e6))  # of the motion
    gram[signals.column("de"), signals.column("de")] = moved / 0.5**2
    gram[signals.column("da"), signals.column("da")] = 1.0 / 0.2**2
    shares = np.full(3, gusts)
    return gust_correlation.of_solution(plan, solution, gram, shares)


def test_the_less_surfaces_are_moved_on_purpose_the_more_they_may_answer_gusts() -> None:
    """By the ratio of energies, in all coefficients of the same regressors: lift has the elevator of the moment."""
    hundredth = 0.1 * ANSWERED
    np.testing.assert_allclose(correlation(moved=4.0, left=4.0), [ANSWERED, ANSWERED, hundredth])
    np.testing.assert_allclose(correlation(moved=1.0, left=4.0), [2.0 * ANSWERED, 2.0 * ANSWERED, hundredth])
    np.testing.assert_allclose(correlation(moved=1.0, left=1e6), [1.0, 1.0, hundredth])


def test_intervals_are_as_wide_as_the_correlation_asks_and_never_narrower_than_what_is_always_allowed() -> None:
    of = spread(np.ones(3), 100.0)
    found = gust_correlation.inflation(of, np.array([1.0, 0.5, 1.0]), np.array([0.3, 0.3, 0.001]))
    np.testing.assert_allclose(found, [1.0 + 0.09 * 100.0, 1.0 + 0.09 * 50.0, 1.0 + ALLOWED**2 * 100.0])


def test_what_sensors_leave_is_no_gust_that_surfaces_answer() -> None:
    np.testing.assert_allclose(correlation(moved=1.0, left=4.0, gusts=0.0), 0.0)
    np.testing.assert_allclose(correlation(moved=1.0, left=4.0, gusts=0.25)[:2], ANSWERED)


def test_a_surface_that_never_moved_says_nothing() -> None:
    np.testing.assert_allclose(correlation(moved=0.0, left=4.0)[:2], 0.0)


def test_a_residual_tells_of_the_gusts_in_the_regressors_of_its_axis() -> None:
    """The drag's for the drag alone, lift's and pitching moment's for all three."""
    found = gust_correlation.share_by_axis(["CL", "CD", "Cm", "CY", "Cl"], np.array([0.1, 0.9, 0.3, 0.0, 0.6]))
    np.testing.assert_allclose(found, [0.3, 0.9, 0.3, 0.6, 0.6])


def answered(rate: Array, instrument: Array, gusts: float = 1.0) -> bool:
    """Whether the pitching moment's surfaces are said to do nothing but answer gusts, by signals over time."""
    signals = layout(AIRCRAFT, ("q",))
    plan = normal_equations.normal_equations({"Cm": ("q", "de")}, signals)
    lines = np.zeros((rate.size, signals.width))
    lines[:, signals.column("q")], lines[:, signals.instrument("q")] = rate, instrument
    (found,) = gust_correlation.only_answered(plan, lines.T @ lines, np.array([gusts]))
    return bool(found)


@pytest.mark.parametrize("gain", [0.3, 1.0, 8.0])
def test_a_loop_that_does_nothing_but_answer_gusts_is_seen_whatever_its_gain(gain: float) -> None:
    """x = z + g with z = -L x': the slope of x on z is -1 / L. Half of x is what the loop does not see."""
    rng = np.random.default_rng(4)
    seen, unseen = rng.normal(size=(2, 500)) / (1.0 + gain)
    assert answered(seen + unseen, -gain * seen)


def test_a_flight_with_a_manoeuvre_is_not_taken_for_one_that_answers_gusts() -> None:
    """Not with a file that is wrong by half, nor with one whose surface has the wrong sign, nor in still air."""
    rng = np.random.default_rng(5)
    manoeuvre, gusts = rng.normal(size=(2, 500))
    rate = manoeuvre + 0.7 * gusts
    for wrong in (0.5, 1.0, 1.5, -1.0):
        assert not answered(rate, wrong * manoeuvre)
    answers, left = -0.8 * gusts, 0.2 * (gusts + rng.normal(size=500))
    assert answered(left, answers)
    assert not answered(left, answers, gusts=0.0)


def test_a_rate_that_has_no_instrument_tells_nothing() -> None:
    assert not answered(np.ones(5), np.zeros(5))
