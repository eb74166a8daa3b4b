"""Sensitivities to errors of the instruments without vanes, against finite differences of the whole estimator.

The flow angles are then integrals of what the IMU reads, by the filter, in which all of the equations are nonlinear.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from plant import fly, made_aircraft, multisteps

from sysid_node.online import estimator
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.types import SAMPLE_COLUMNS

RATE, SECONDS = 100.0, 25.4  # Hz; s: one segment
EXACT = made_aircraft()
SETTINGS = OnlineSettings(method="sls_rft", detect_changes=False, actuators="positions")
COLUMN = {name: SAMPLE_COLUMNS.index(name) for name in ("ax", "ay", "az", "p", "q", "r", "V")}
ANGLES = [SAMPLE_COLUMNS.index(name) for name in ("alpha", "beta")]


@cache
def flown() -> tuple[np.ndarray, np.ndarray]:
    """Times, and samples without flow angles."""
    time, flights = fly(EXACT, multisteps(SECONDS, RATE), RATE, 1, noise=0.0)
    flights[0][:, ANGLES] = np.nan
    return time, flights[0]


def identified(aircraft, samples) -> EstimatorState:
    state = estimator.init(aircraft, SETTINGS)
    for time, sample in zip(flown()[0].tolist(), samples.tolist(), strict=True):
        estimator.update(state, time, sample)
    return state


def slopes(state, names) -> np.ndarray:
    found = estimate(state).derivatives
    return np.array([found[name].value for name in names])


def scaled(name, by):
    samples = flown()[1].copy()
    samples[:, COLUMN[name]] *= 1.0 + by
    return samples


def turned(about, by):
    """Readings of an IMU that is turned the other way about an axis: the true ones have one axis more of the next."""
    one, other = (about + 1) % 3, (about + 2) % 3
    true, samples = flown()[1], flown()[1].copy()
    for first in (COLUMN["ax"], COLUMN["p"]):
        samples[:, first + one] = true[:, first + one] - by * true[:, first + other]
        samples[:, first + other] = true[:, first + other] + by * true[:, first + one]
    return samples


def shifted(name, by):
    samples = flown()[1].copy()
    samples[:, COLUMN[name]] += by
    return samples


#: What the readings are to be, the derivatives that change most, and how far a sensitivity may be off, as a share.
CASES = {
    "imu_scale.q": (lambda by: scaled("q", -by), ("CL_alpha", "CL_q", "Cm_alpha", "Cm_q", "Cm_de"), 0.1),
    "imu_scale.r": (lambda by: scaled("r", -by), ("CY_beta", "CY_p", "Cl_beta", "Cl_p", "Cn_p", "Cn_dr"), 0.1),
    "imu_scale.ay": (lambda by: scaled("ay", -by), ("CY_beta", "CY_dr"), 0.1),
    "imu_bias.ay": (lambda by: shifted("ay", -by), ("CL_q", "CL_de", "Cm_q", "Cm_de"), 0.2),
    "airspeed_scale.error": (lambda by: scaled("V", -by), ("CL_alpha", "Cm_alpha", "Cm_q", "Cl_beta", "Cn_beta"), 0.25),
    "imu_misalignment.yaw": (lambda by: turned(2, by), ("CL_q", "CL_de"), 0.25),
    # the attitude turns as well, but for the part that the references hold
    "imu_misalignment.roll": (lambda by: turned(0, by), ("CL_q", "CL_de", "Cm_q", "Cm_de", "CY_r"), 0.5),
}


def uncertain(key, step):
    if key.startswith("imu_bias"):
        return replace(
            EXACT, noise_bias={**EXACT.noise_bias, "accel": step}, stated_tolerances={"noise.bias.accel": step}
        )
    return replace(EXACT, stated_tolerances={key: step})


@cache
def unchanged() -> EstimatorState:
    """What is identified of the readings as they are."""
    return identified(EXACT, flown()[1])


@pytest.mark.slow
@pytest.mark.parametrize("key", CASES)
def test_sensitivities_are_those_of_the_estimator(key):
    step, (changed, names, share) = 1e-3, CASES[key]
    state = identified(uncertain(key, step), flown()[1])
    assert state.model.imperfections is not None and state.latest is not None and state.latest.systematic is not None
    assert state.model.imperfections.reconstructed == (True, True)
    place = state.model.imperfections.keys.index(key)
    jacobian = state.latest.systematic.considered.jacobian[place].reshape(-1)[state.model.table.place]
    sensitivity = jacobian[[list(EXACT.derivatives).index(name) for name in names]]
    ahead = slopes(identified(EXACT, changed(step)), names)
    np.testing.assert_allclose(sensitivity, (ahead - slopes(unchanged(), names)) / step, rtol=share)


def test_an_error_of_the_mean_angle_of_attack_is_turned_into_the_sideslip():
    """The mean is that at which the file has the measured lift: files with other offsets of the lift."""
    names, step = ("CY_beta", "CY_p", "Cl_p", "Cn_p"), 1e-3
    state = identified(uncertain("imu_scale.q", 1e-6), flown()[1])
    assert state.model.imperfections is not None and state.latest is not None and state.latest.systematic is not None
    place = state.model.imperfections.keys.index("mean_alpha")
    jacobian = state.latest.systematic.considered.jacobian[place].reshape(-1)[state.model.table.place]
    sensitivity = jacobian[[list(EXACT.derivatives).index(name) for name in names]]
    ahead = slopes(identified(with_mean_alpha(step), flown()[1]), names)
    difference = (ahead - slopes(unchanged(), names)) / step
    np.testing.assert_allclose(sensitivity, difference, rtol=0.1)


def with_mean_alpha(by):
    """A file by which the same lift needs an angle of attack that is larger by so much."""
    offset, slope = EXACT.derivatives["CL_0"], EXACT.derivatives["CL_alpha"].value
    changed = replace(offset, value=offset.value - by * slope)
    return replace(EXACT, derivatives={**EXACT.derivatives, "CL_0": changed})


def test_errors_of_vanes_are_none_without_vanes():
    """A file that is unsure of its vanes alone has nothing uncertain in a flight without any."""
    tolerances = {"vane_scale.alpha": 0.05, "vane_scale.beta": 0.05, "imu_scale.q": 0.01}
    state = identified(replace(EXACT, stated_tolerances=tolerances), flown()[1])
    assert state.model.imperfections is not None
    assert state.model.imperfections.keys == ("imu_scale.q", "mean_alpha")


def test_one_vane_leaves_the_other_angle():
    samples = fly(EXACT, multisteps(SECONDS, RATE), RATE, 1, noise=0.0)[1][0]
    samples[:, ANGLES[1]] = np.nan
    tolerances = {"vane_scale.alpha": 0.05, "vane_scale.beta": 0.05, "imu_scale.q": 0.01, "imu_scale.r": 0.01}
    state = identified(replace(EXACT, stated_tolerances=tolerances), samples)
    imperfect = state.model.imperfections
    assert imperfect is not None and state.latest is not None and state.latest.systematic is not None
    assert imperfect.reconstructed == (False, True)
    assert imperfect.keys == ("imu_scale.q", "imu_scale.r", "vane_scale.alpha")
    changes = state.latest.systematic.known[1]
    alpha, beta = (changes.columns.place(state.model.layout.column(name)) for name in ("alpha", "beta"))
    moved = np.abs(changes.signals).sum(axis=2) > 0.0
    assert moved[:, alpha].tolist() == [False, False, True]
    assert moved[:, beta].tolist() == [False, True, False]
