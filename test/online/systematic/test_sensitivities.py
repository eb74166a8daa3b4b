"""Sensitivities to imperfections against finite differences of the whole estimator, and servos that are found.

The samples of a flight are changed as the imperfection changes them, and identified once more.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from plant import fly, made_aircraft, multisteps
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from sysid_node.aircraft.model import Aircraft, Inertia, Sensors
from sysid_node.online import estimator
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.types import SAMPLE_COLUMNS, Estimates

RATE = 100.0
AX, AZ, Q, V, ALPHA, RHO, THRUST = (SAMPLE_COLUMNS.index(n) for n in ("ax", "az", "q", "V", "alpha", "rho", "thrust"))
ELEVATOR = len(SAMPLE_COLUMNS)
EXACT = made_aircraft()
#: One tolerance at a time, so that the flight's correction for another does not come between.
SETTINGS = OnlineSettings(method="sls_rft", detect_changes=False, actuators="positions")
SECONDS = 25.4  # one segment


@cache
def flown(noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    time, flights = fly(EXACT, multisteps(SECONDS, RATE), RATE, 1, noise=noise)
    return time, flights[0]


def identified(aircraft: Aircraft, samples: np.ndarray, settings: OnlineSettings = SETTINGS) -> EstimatorState:
    state = estimator.init(aircraft, settings)
    for time, sample in zip(flown()[0].tolist(), samples.tolist(), strict=True):
        estimator.update(state, time, sample)
    return state


def scaled(*columns: int) -> Callable[[np.ndarray, float], None]:
    def change(samples: np.ndarray, by: float) -> None:
        samples[:, columns] *= 1.0 + by

    return change


def shifted(column: int) -> Callable[[np.ndarray, float], None]:
    def change(samples: np.ndarray, by: float) -> None:
        samples[:, column] += by

    return change


#: The tolerance, and what a quantity that is larger than was taken changes in the samples as they should be.
CASES = {
    "airspeed_scale.error": (1e-3, lambda s, by: scaled(V)(s, -by)),
    "vane_scale.alpha": (1e-3, lambda s, by: scaled(ALPHA)(s, -by)),
    "vane_bias.alpha": (1e-4, lambda s, by: shifted(ALPHA)(s, -by)),
    "imu_scale.az": (1e-3, lambda s, by: scaled(AZ)(s, -by)),
    "imu_bias.ax": (1e-2, lambda s, by: shifted(AX)(s, -by)),
    "imu_scale.q": (1e-3, lambda s, by: scaled(Q)(s, -by)),
    "air_density": (1e-3, scaled(RHO)),
    "throttle.max_thrust": (0.03, lambda s, by: scaled(THRUST)(s, by / 30.0)),
    "controls.elevator.scale": (1e-3, scaled(ELEVATOR)),
}


@pytest.mark.slow
@pytest.mark.parametrize("key", CASES)
def test_sensitivities_are_those_of_the_estimator(key):
    step, change = CASES[key]
    _, samples = flown()
    uncertain = replace(EXACT, stated_tolerances={key: step}) if "bias" not in key else with_bias(key, step)
    state = identified(uncertain, samples)
    assert state.model.imperfections is not None and state.latest is not None and state.latest.systematic is not None
    place = state.model.imperfections.keys.index(key)
    jacobian = state.latest.systematic.considered.jacobian[place].reshape(-1)[state.model.table.place]
    changed = samples.copy()
    change(changed, step)
    difference = (slopes_and_offsets(identified(EXACT, changed)) - unchanged()) / step
    size = np.abs(unchanged()) / step * 1e-3 + 0.02 * np.abs(difference).max()
    assert np.all(np.abs(jacobian - difference) < 0.05 * np.abs(difference) + size)


def test_moments_of_inertia_may_be_unknown():
    """The force derivatives of an aircraft file without moments of inertia are those of one with them."""
    key = "airspeed_scale.error"
    states = [
        identified(replace(EXACT, inertia=inertia, stated_tolerances={key: 1e-3}), flown()[1])
        for inertia in (EXACT.inertia, Inertia(math.nan, math.nan, math.nan))
    ]
    known, unknown = (estimate(state).derivatives for state in states)
    assert unknown["CL_alpha"].value == pytest.approx(known["CL_alpha"].value, rel=1e-2)
    assert unknown["CL_alpha"].systematic_error == pytest.approx(known["CL_alpha"].systematic_error, rel=0.1)


def with_bias(key: str, step: float) -> Aircraft:
    """The aircraft with one constant error of a sensor."""
    sensor = {"vane_bias.alpha": "alpha", "imu_bias.ax": "accel"}[key]
    return replace(EXACT, noise_bias={**EXACT.noise_bias, sensor: step})


def slopes_and_offsets(state: EstimatorState) -> np.ndarray:
    return np.array([d.value for d in estimate(state).derivatives.values()])


@cache
def unchanged() -> np.ndarray:
    """The estimates from the flight as it is: differences to them are accurate enough, as the steps are small."""
    return slopes_and_offsets(identified(EXACT, flown()[1]))


def test_the_imus_place_is_counted():
    """The estimates with the IMU 1 cm off against the sensitivity, by the aircraft file."""
    _, samples = flown()
    state = identified(replace(EXACT, stated_tolerances={"sensors.imu.x": 0.01}), samples)
    assert state.latest is not None and state.latest.systematic is not None and state.model.imperfections is not None
    place = state.model.imperfections.keys.index("sensors.imu.x")
    jacobian = state.latest.systematic.considered.jacobian[place].reshape(-1)[state.model.table.place]
    moved = slopes_and_offsets(identified(replace(EXACT, sensors=Sensors(imu=(0.01, 0.0, 0.0))), samples))
    difference = (moved - unchanged()) / 0.01
    assert np.all(np.abs(jacobian - difference) < 0.05 * np.abs(difference) + 0.02 * np.abs(difference).max())


def at_a_probe(samples: np.ndarray, arm: float) -> np.ndarray:
    """The same flight with the flow as a probe has it ``arm`` (m) in front of the CG: velocity + rates x arm."""
    found = samples.copy()
    speed, alpha, beta = samples[:, V], samples[:, ALPHA], samples[:, ALPHA + 1]
    u, w = speed * np.cos(beta) * np.cos(alpha), speed * np.cos(beta) * np.sin(alpha) - arm * samples[:, Q]
    v = speed * np.sin(beta) + arm * samples[:, Q + 1]
    found[:, V] = np.sqrt(u * u + v * v + w * w)
    found[:, ALPHA], found[:, ALPHA + 1] = np.arctan2(w, u), np.arcsin(v / found[:, V])
    return found


@pytest.mark.parametrize("key", ["airspeed_scale.error", "vane_scale.alpha", "imu_scale.q"])
def test_scales_are_those_of_what_is_read_at_the_probe(key):
    """The flow at the CG is the probe's, which the vane scales, less rates x arm over the airspeed, which it does not.

    Truth: finite differences of the whole estimator.
    """
    arm, (step, change) = 2.0, CASES[key]
    exact, samples = replace(EXACT, sensors=Sensors(air_data=(arm, 0.0, 0.0))), at_a_probe(flown()[1], arm)
    state = identified(replace(exact, stated_tolerances={key: step}), samples)
    assert state.latest is not None and state.latest.systematic is not None
    jacobian = state.latest.systematic.considered.jacobian[0].reshape(-1)[state.model.table.place]
    ends = []
    for by in (-step, step):
        changed = samples.copy()
        change(changed, by)
        ends.append(slopes_and_offsets(identified(exact, changed)))
    difference = (ends[1] - ends[0]) / (2.0 * step)
    slopes = [not name.endswith("_0") for name in EXACT.derivatives]
    size = 0.01 * np.abs(difference).max()
    assert np.all(np.abs(jacobian - difference)[slopes] < (0.05 * np.abs(difference) + size)[slopes])


def test_late_air_data_are_those_of_the_probe():
    """Air data that are read later, at the probe and not at the CG, where the aircraft's rates are not in them."""
    arm, step = 0.5, 1e-3
    exact, samples = replace(EXACT, sensors=Sensors(air_data=(arm, 0.0, 0.0))), at_a_probe(flown()[1], arm)
    state = identified(replace(exact, stated_tolerances={"delays.air_data": step}), samples)
    assert state.latest is not None and state.latest.systematic is not None
    jacobian = state.latest.systematic.considered.jacobian[0].reshape(-1)[state.model.table.place]
    time, air = flown()[0], [V, ALPHA, ALPHA + 1]
    ends = []
    for by in (-step, step):
        changed = samples.copy()
        changed[:, air] = CubicSpline(time, samples[:, air])(np.clip(time + by, time[0], time[-1]))
        ends.append(slopes_and_offsets(identified(exact, changed)))
    difference = (ends[1] - ends[0]) / (2.0 * step)
    slopes = [not name.endswith("_0") for name in EXACT.derivatives]
    size = 0.02 * np.abs(difference).max()
    assert np.all(np.abs(jacobian - difference)[slopes] < (0.1 * np.abs(difference) + size)[slopes])


def late(samples: np.ndarray, lag: float) -> np.ndarray:
    """The same flight recorded with commands, which the deflections followed with a lag (s): commands are ahead.

    It is undone exactly for commands that go in straight lines between samples: y1 = d y0 + (r - d) u0 + (1 - r) u1.
    """
    found, step = samples.copy(), 1.0 / RATE
    d = np.exp(-step / lag)
    r = lag / step * (1.0 - d)
    trim = samples[0, ELEVATOR:]
    found[:, ELEVATOR:] = trim + lfilter([1.0, -d], [1.0 - r, r - d], samples[:, ELEVATOR:] - trim, axis=0)
    return found


def known_with_servos(lag: float) -> Estimates:
    tolerances = {f"actuator_lag.{name}": 0.06 for name in EXACT.controls}
    aircraft = replace(EXACT, stated_tolerances=tolerances)
    settings = replace(SETTINGS, method="iv_rft", actuators="auto")
    return estimate(identified(aircraft, late(flown(1.0)[1], lag), settings))


@pytest.mark.parametrize("lag", [0.03])
def test_servos_are_found_and_derivatives_corrected(lag):
    found = known_with_servos(lag)
    for servo in found.servos.values():
        assert servo.valid
        assert abs(servo.value - lag) < 3.0 * servo.standard_error
    for name, d in found.derivatives.items():
        assert abs(d.value - EXACT.derivatives[name].value) < 4.0 * d.standard_error + 1e-4, name


def test_a_servo_that_would_be_ahead_of_its_command_is_refused_with_what_rests_on_it():
    """Controls recorded 60 ms too late, far beyond what stamps may be off: no servo answers before its command."""
    time, samples = flown(1.0)
    late = samples.copy()
    late[:, ELEVATOR:] = CubicSpline(time, samples[:, ELEVATOR:])(np.maximum(time - 0.06, time[0]))
    tolerances = {f"actuator_lag.{name}": 0.06 for name in EXACT.controls} | {"delays.actuators": 0.001}
    settings = replace(SETTINGS, method="iv_rft", actuators="auto")
    found = estimate(identified(replace(EXACT, stated_tolerances=tolerances), late, settings))
    assert found.servos["elevator"].status == "ahead of its command"
    assert not any(servo.valid for servo in found.servos.values())
    assert found.derivatives["Cm_de"].status == "de not on time"
    assert not any(found.derivatives[name].valid for name in ("Cm_alpha", "Cm_q", "Cl_p", "Cl_da", "Cn_dr"))
