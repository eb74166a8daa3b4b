"""The aircraft file as a first guess; truth: noise of known size, and the file's own derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.record import FlightRecord
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.surrogate.first_guess import first_guess

AIRCRAFT = load_aircraft("cdrw")


def flown(gyro: float) -> GapFlight:
    """A smooth record of 30 s whose gyroscopes are as noisy as asked for."""
    time, random = np.arange(0.0, 30.0, 0.01), np.random.default_rng(4)
    columns = {name: np.sin((1.0 + 0.3 * k) * time) for k, name in enumerate(("ax", "ay", "az", "V", "alpha", "beta"))}
    columns |= {name: np.sin(2.0 * time) + gyro * random.standard_normal(time.size) for name in "pqr"}
    columns |= {name: 0.1 * np.cos(time) for name in ("phi", "theta")}
    return GapFlight(FlightRecord(time, columns), 100.0, 100.0, 100.0)


def test_noise_is_that_of_the_simulated_sensors() -> None:
    noise = first_guess(AIRCRAFT, [flown(0.02)]).noise
    assert noise["gyro"] == pytest.approx(0.02, rel=0.05)
    assert noise["attitude"] < 0.01 * AIRCRAFT.noise["attitude"]


def test_sensors_without_noise_keep_a_little() -> None:
    assert first_guess(AIRCRAFT, [flown(0.0)]).noise["gyro"] > 0.0


def test_derivatives_that_the_file_lacks_are_added_as_zero() -> None:
    bare = {name: d for name, d in AIRCRAFT.derivatives.items() if name not in {"CL_q", "Cn_da"}}
    guess = first_guess(replace(AIRCRAFT, derivatives=bare), [flown(0.0)])
    assert set(guess.derivatives) == set(AIRCRAFT.derivatives)
    assert guess.derivatives["CL_q"].value == 0.0 and guess.derivatives["CL_q"].tolerance > 1.0


def test_every_derivative_may_be_twice_as_large() -> None:
    guess = first_guess(AIRCRAFT, [flown(0.0)])
    assert all(3.0 * d.tolerance > abs(d.value) for d in guess.derivatives.values() if d.tolerance)
