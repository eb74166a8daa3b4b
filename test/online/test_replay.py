"""A replay: what falls due when, and that estimates do not depend on when else estimates were asked for."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import exact_flight, made_aircraft

from sysid_node.aircraft.model import Sensors
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft(sensors=Sensors((0.05, 0.01, -0.02), (0.5, 0.1, -0.05)))
SECONDS, RATE = 14.0, 100.0
THRUST = SAMPLE_COLUMNS.index("thrust")


def flight(seed: int = 0, seconds: float = SECONDS) -> tuple[Array, Array]:
    """Jittered times and noisy samples."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / RATE)
    time += rng.uniform(-0.3, 0.3, time.size) / RATE
    samples = exact_flight(AIRCRAFT, time, seed)
    samples[:, :9] *= 1.0 + 0.05 * rng.normal(size=(time.size, 9))
    return time, samples


@pytest.mark.parametrize(
    "settings",
    [
        OnlineSettings(),
        OnlineSettings(method="sls_rft", forgetting_time=5.0),
        OnlineSettings(window=10.0, use_prior=True),
        OnlineSettings(frequencies=(0.2, 0.1, 1.1), settle_time=0.0),  # ten lines: not a whole number of registers
        OnlineSettings(frequencies=(0.5, 0.5, 10.0)),  # lines whose period is near the sampling interval
    ],
    ids=str,
)
def test_estimates_are_the_same_bits_however_often_they_are_asked_for(settings: OnlineSettings) -> None:
    """Samples are transformed when estimates are asked for; ``repr`` of a float tells every bit of it."""
    time, samples = flight()
    samples[700:703, 7] = math.nan
    keep = np.r_[0:300, 380 : time.size]  # a gap of 0.8 s
    time, samples = time[keep], samples[keep]
    every = run(AIRCRAFT, settings, time, samples, time[::3])
    seldom = run(AIRCRAFT, settings, time, samples, time[::111])
    assert repr(every[::37]) == repr(seldom)
    assert math.isfinite(seldom[-1].derivatives["Cm_de"].value)


@pytest.mark.parametrize("lost", [slice(400, 403), slice(1000, None)])
def test_samples_without_thrust_are_left_out_once_it_is_known(lost: slice) -> None:
    time, samples = flight(2)
    samples[lost, THRUST] = np.nan
    kept, settings = np.isfinite(samples[:, THRUST]), OnlineSettings(detect_changes=False)
    found = run(AIRCRAFT, settings, time, samples, np.array([9.0]))
    assert repr(found) == repr(run(AIRCRAFT, settings, time[kept], samples[kept], np.array([9.0])))
    assert found[0].derivatives["CL_0"].status != "thrust not measured"


def test_thrust_that_comes_late_is_not_believed() -> None:
    time, samples = flight(2)
    samples[:300, THRUST] = np.nan
    found = run(AIRCRAFT, OnlineSettings(detect_changes=False), time, samples, np.array([13.0]))
    assert found[0].derivatives["CL_0"].status == "thrust not measured"


def test_at_most_one_estimate_a_sample_and_none_beyond_the_end() -> None:
    time, samples = flight(5, 0.5)
    found = run(AIRCRAFT, OnlineSettings(settle_time=0.0), time, samples, np.arange(0.0, 10.0, 0.001))
    assert [one.time for one in found] == time.tolist()


def test_progress_is_told() -> None:
    time, samples = flight(6)
    heard: list[float] = []
    run(AIRCRAFT, OnlineSettings(), time, samples, np.empty(0), heard.append)
    assert heard == sorted(set(heard))
    assert heard[-1] == time[-1]


def test_no_samples_give_no_estimates() -> None:
    assert run(AIRCRAFT, OnlineSettings(), np.empty(0), np.empty((0, 15)), np.array([1.0])) == []


def test_a_heavier_aircraft_is_noticed_between_renewals() -> None:
    """After 20 s of data some pieces are only tested for changes; estimates lean on what was known before the test."""
    rng, time = np.random.default_rng(4), np.arange(0.0, 48.0, 1.0 / 50.0)
    other = replace(AIRCRAFT, mass=1.3 * AIRCRAFT.mass)
    before, after = (exact_flight(aircraft, time, 4) for aircraft in (AIRCRAFT, other))
    samples = np.where(time[:, None] < 36.0, before, after)
    samples[:, :9] *= 1.0 + 0.05 * rng.normal(size=(time.size, 9))
    found = run(AIRCRAFT, OnlineSettings(), time, samples, np.arange(0.1, 48.0, 0.1))
    statuses = {d.status for estimates in found for d in estimates.derivatives.values() if estimates.time > 36.0}
    assert statuses - {"ok", "converging"}


def test_commands_may_be_told_in_the_midst_of_a_flight_without_thrust() -> None:
    """Samples of a flight that holds commands have places for the deflections' excess from the beginning."""
    time, samples = flight(3, 4.0)
    samples[:, THRUST] = np.nan
    wide = np.hstack([samples, np.zeros((time.size, len(AIRCRAFT.controls)))])
    settings, due = OnlineSettings(settle_time=0.0), time[[150, -1]]
    before, _ = run(AIRCRAFT, settings, time, samples, due)
    early, late = run(AIRCRAFT, settings, time, wide, due, commands_from=200)
    assert repr(early) == repr(before)
    assert math.isfinite(late.derivatives["Cm_de"].value)
