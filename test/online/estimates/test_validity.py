"""What an estimate is called. Truth: the derivatives that the flight was simulated with."""

from functools import cache

import numpy as np
from plant import TRUTH, fly, made_aircraft, multisteps

from sysid_node.online import estimator
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS, Estimates

RATE, SECONDS, LATE = 100.0, 40.0, 2  # Hz, s, samples
EXACT, ELEVATOR = made_aircraft(), len(SAMPLE_COLUMNS)


@cache
def estimated(samples_late: int) -> Estimates:
    """Of one flight, whose elevator was felt so many samples after its recorded deflection."""
    time, (samples,) = fly(EXACT, multisteps(SECONDS, RATE), RATE)
    samples[:, ELEVATOR] = np.roll(samples[:, ELEVATOR], -samples_late)
    state = estimator.init(EXACT, OnlineSettings(method="sls_rft", actuators="positions"))
    for at, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, at, sample)
    return estimate(state)


def test_a_surface_that_the_pitching_moment_feels_late_is_late_for_lift_and_drag() -> None:
    found = estimated(LATE).derivatives
    for name in ("Cm_alpha", "CL_alpha", "CL_de", "CD_alpha", "CD_0"):
        assert found[name].status == "de not on time", name


def test_a_late_elevator_says_nothing_of_roll_and_yaw() -> None:
    found = estimated(LATE).derivatives
    assert all(found[name].valid for name in ("CY_beta", "Cl_p", "Cl_da", "Cn_r", "Cn_dr"))


def test_what_is_valid_is_near_the_truth() -> None:
    for late in (0, LATE):
        found = estimated(late).derivatives
        valid = {name: d for name, d in found.items() if d.valid and name in TRUTH}
        assert len(valid) >= (12 if late else 20)
        for name, d in valid.items():
            assert abs(d.value - TRUTH[name]) < 4.0 * d.standard_error, name
