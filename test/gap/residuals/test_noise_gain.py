"""The noise's power as a quadratic form; truth: other realisations of the noise, differences, and the file itself."""

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.flight.record import FlightRecord
from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.flightdata.gap_flight import resampled
from sysid_node.gap.residuals.build import noiseless_model, residual_model_of
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.sensor_noise import with_added_noise
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def gusty(aircraft) -> ResidualModel:
    return residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {}, seed=12, turbulence="light"))


def smaller(model: ResidualModel, share: float) -> np.ndarray:
    """The file's parameters with all derivatives of the pitching moment and the lift smaller by a share."""
    simulator, theta = model.simulator, model.simulator.neutral()
    for name, derivative in simulator.aircraft.derivatives.items():
        if name.startswith(("Cm_", "CL_")):
            theta[simulator.names.index(f"derivative_error.{name}")] = -share * derivative.value
    return theta


def noise_at(model: ResidualModel, theta: np.ndarray, record: FlightRecord) -> np.ndarray:
    """Power (L, 12) of the noise of another realisation in the residual at parameters (P,)."""
    noisy = noiseless_model(model.simulator, model.flight, record, model.windows, model.axes, model.inputs.memory)
    return (np.abs(noisy.residual(theta) - model.residual(theta)) ** 2).mean(axis=0)


@pytest.mark.slow
def test_smaller_derivatives_leave_less_noise_as_other_realisations_show(gusty) -> None:
    """The vanes' noise is in Cm and CL times their slopes; eight other realisations of it.

    Interpolation between stamps makes it less in the record; all of the form is lowered by as much. Three powers are
    compared, each a mean of about a hundred amplitudes: 17 % (1 sigma).
    """
    theta, neutral = smaller(gusty, 0.3), gusty.simulator.neutral()
    random = np.random.default_rng(7)
    records = [
        resampled(with_added_noise(gusty.simulator.aircraft, gusty.flight, random), gusty.simulator.rate)
        for _ in range(8)
    ]
    change = np.mean([noise_at(gusty, theta, r) - noise_at(gusty, neutral, r) for r in records], axis=0)
    excess = gusty.excess_noise(theta)
    recorded = gusty.windows.smoothed((np.abs(gusty.residual(neutral)) ** 2).mean(axis=0)) / gusty.noise
    change *= np.minimum(recorded, 1.0)
    for name in ("Cm", "CL"):
        axis = CHANNELS.index(name)
        assert excess[:, axis].sum() < 0.0
        assert excess[:, axis].sum() == pytest.approx(change[:, axis].sum(), rel=0.35)
    np.testing.assert_allclose(excess[:, [CHANNELS.index(n) for n in ("CY", "Cl", "Cn")]], 0.0, atol=1e-15)


def test_nothing_is_in_excess_at_the_file(gusty) -> None:
    assert not gusty.excess_noise(gusty.simulator.neutral()).any()


def test_the_slope_agrees_with_differences(gusty) -> None:
    theta, step = smaller(gusty, 0.2), 1e-4
    for place, index in enumerate(gusty.gain.indices):
        up, down = theta.copy(), theta.copy()
        up[index] += step
        down[index] -= step
        numeric = (gusty.excess_noise(up) - gusty.excess_noise(down)) / (2.0 * step)
        slope = gusty.gain.slope(theta)[..., place]
        np.testing.assert_allclose(slope, numeric, rtol=1e-6, atol=1e-6 * np.abs(slope).max())


def test_a_flight_in_still_air_needs_none(plain_model) -> None:
    """There the flow is followed by the inertial instruments, whose noise is small."""
    assert plain_model.gain is None


def test_derivatives_are_not_biased_toward_zero_by_noisy_vanes(aircraft) -> None:
    """Truth: the file flies itself, with vanes four times as noisy as usual. Means of two flights, in percent."""
    noisy = replace(aircraft, noise={**aircraft.noise, "alpha": 0.015, "beta": 0.015})
    errors: dict[bool, list[list[float]]] = {True: [], False: []}
    for seed in (12, 13):
        model = residual_model_of(Simulator(noisy, 50.0), fly(noisy, {}, seed=seed, turbulence="light"))
        for corrected, seen in ((True, model), (False, replace(model, gain=None))):
            point = converged(unfitted([seen], nuisances_of(noisy, seen))).flights[0].point
            shift = {n: point[model.simulator.names.index(f"derivative_error.{n}")] for n in ("CL_alpha", "Cm_q")}
            errors[corrected].append([100.0 * e / noisy.derivatives[n].value for n, e in shift.items()])
    with_gain, without = np.mean(errors[True], axis=0), np.mean(errors[False], axis=0)
    assert (without < -3.0).all()
    assert (np.abs(with_gain) < 0.5 * np.abs(without)).all()
    assert abs(with_gain[0]) < 1.0
