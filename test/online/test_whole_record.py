"""A whole record at once gives what ``update`` with every sample gives, to the last bit, whatever the record holds."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plant import exact_flight, made_aircraft

from sysid_node.aircraft.model import Aircraft, Sensors
from sysid_node.online import estimator, whole_record
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import Settings
from sysid_node.online.types import SAMPLE_COLUMNS, Estimates

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft(sensors=Sensors((0.05, 0.01, -0.02), (0.5, 0.1, -0.05)))
SECONDS, RATE = 14.0, 100.0
THRUST = SAMPLE_COLUMNS.index("thrust")


def flight(seed: int = 0, aircraft: Aircraft = AIRCRAFT) -> tuple[Array, Array]:
    """Jittered times and noisy samples."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, 1.0 / RATE)
    time += rng.uniform(-0.3, 0.3, time.size) / RATE
    samples = exact_flight(aircraft, time, seed)
    samples[:, :9] *= 1.0 + 0.05 * rng.normal(size=(time.size, 9))
    return time, samples


def one_by_one(aircraft: Aircraft, settings: Settings, time: Array, samples: Array, publish: Array) -> list[Estimates]:
    """Estimates after the first sample at or past each time, through ``update``."""
    state = estimator.init(aircraft, settings)
    due = sorted({int(i) for i in np.searchsorted(time, publish) if i < time.size})
    found = []
    for i, (t, sample) in enumerate(zip(time.tolist(), samples.tolist(), strict=True)):
        estimator.update(state, t, sample)
        if i in due:
            found.append(estimate(state, t))
    return found


def assert_same(aircraft: Aircraft, settings: Settings, time: Array, samples: Array, publish: Array) -> list[Estimates]:
    """``repr`` of a float tells every bit of it."""
    single = one_by_one(aircraft, settings, time, samples, publish)
    whole = whole_record.run(aircraft, settings, time, samples, publish)
    assert len(single) == len(whole)
    for one, many in zip(single, whole, strict=True):
        assert repr(one) == repr(many)
    return whole


@pytest.mark.parametrize(
    "settings",
    [
        Settings(),
        Settings(method="sls_rft"),
        Settings(method="iv_rft"),
        Settings(forgetting_time=5.0),
        Settings(window=10.0),
        Settings(use_prior=True),
        Settings(detect_changes=False),
        Settings(settle_time=0.0),
        Settings(frequencies=(0.2, 0.1, 1.1)),  # ten lines: not a whole number of registers
        Settings(frequencies=(0.1, 0.037, 1.9), forgetting_time=8.0, method="sls_rft"),
        Settings(frequencies=(0.5, 0.5, 10.0)),  # lines whose period is near the sampling interval
    ],
    ids=str,
)
def test_settings(settings: Settings) -> None:
    time, samples = flight()
    found = assert_same(AIRCRAFT, settings, time, samples, np.arange(0.3, SECONDS, 0.7))
    assert math.isfinite(found[-1].derivatives["Cm_de"].value)


def test_lost_samples_gaps_and_columns_that_are_missing() -> None:
    time, samples = flight(1)
    rng = np.random.default_rng(2)
    samples[rng.random(time.size) < 0.03, 7] = np.nan
    samples[rng.random(time.size) < 0.02, 2] = np.inf
    samples[500:800, THRUST] = np.nan
    keep = rng.random(time.size) > 0.1
    keep[300:330] = keep[900:1000] = False
    assert_same(AIRCRAFT, Settings(), time[keep], samples[keep], np.arange(0.0, SECONDS, 0.25))


@pytest.mark.parametrize("lost", [slice(400, 403), slice(1000, None)])
def test_samples_without_thrust_are_left_out_once_it_is_known(lost: slice) -> None:
    time, samples = flight(2)
    samples[lost, THRUST] = np.nan
    found = assert_same(AIRCRAFT, Settings(detect_changes=False), time, samples, np.array([9.0, 13.0]))
    kept = np.isfinite(samples[:, THRUST])
    again = whole_record.run(AIRCRAFT, Settings(detect_changes=False), time[kept], samples[kept], np.array([9.0]))
    assert repr(found[0]) == repr(again[0])
    assert found[0].derivatives["CL_0"].status != "thrust not measured"


def test_thrust_that_comes_late_is_not_believed() -> None:
    time, samples = flight(2)
    samples[:300, THRUST] = np.nan
    found = assert_same(AIRCRAFT, Settings(detect_changes=False), time, samples, np.array([9.0, 13.0]))
    assert found[1].derivatives["CL_0"].status == "thrust not measured"


def test_repeated_and_too_early_times() -> None:
    """Samples no later than the one before are left out alike, at the edges of chunks too."""
    time, samples = flight(7)
    time[[50, 51, 400]] = time[49]
    time[whole_record.CHUNK] = time[whole_record.CHUNK - 1] + 1e-6
    time[700:] -= 0.05
    order = np.searchsorted(np.maximum.accumulate(time), np.arange(0.3, SECONDS, 0.9))
    assert_same(AIRCRAFT, Settings(), time, samples, np.maximum.accumulate(time)[order])


@pytest.mark.parametrize("memory", [{}, {"forgetting_time": 8.0}])
def test_an_abrupt_change(memory: dict[str, float]) -> None:
    time, samples = flight(3)
    rows = time >= 8.0
    samples[rows] = exact_flight(
        made_aircraft(
            {n: d.value * (0.4 if n == "Cm_de" else 1.0) for n, d in AIRCRAFT.derivatives.items()},
            sensors=AIRCRAFT.sensors,
        ),
        time[rows],
        3,
    )
    assert_same(AIRCRAFT, Settings(**memory), time, samples, np.arange(5.0, SECONDS, 0.25))


def test_chunks_leave_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    time, samples = flight(4)
    monkeypatch.setattr(whole_record, "CHUNK", 137)
    assert_same(AIRCRAFT, Settings(), time, samples, np.arange(0.0, SECONDS, 1.0))


def test_at_most_one_estimate_a_sample_and_none_beyond_the_end() -> None:
    time, samples = flight(5)
    found = whole_record.run(AIRCRAFT, Settings(settle_time=0.0), time[:50], samples[:50], np.arange(0.0, 10.0, 0.001))
    assert [one.time for one in found] == time[:50].tolist()


def test_progress_is_told() -> None:
    time, samples = flight(6)
    heard: list[float] = []
    whole_record.run(AIRCRAFT, Settings(), time, samples, np.empty(0), heard.append)
    assert heard == sorted(set(heard))
    assert heard[-1] == time[-1]


def test_no_samples_give_no_estimates() -> None:
    assert whole_record.run(AIRCRAFT, Settings(), np.empty(0), np.empty((0, 15)), np.array([1.0])) == []


spoilers: dict[str, Callable[[np.random.Generator, Array], None]] = {
    "nan": lambda rng, x: x.__setitem__((rng.integers(len(x)), rng.integers(x.shape[1])), np.nan),
    "inf": lambda rng, x: x.__setitem__((rng.integers(len(x)), rng.integers(x.shape[1])), -np.inf),
    "stopped": lambda rng, x: x.__setitem__((slice(rng.integers(len(x)), None), 6), 0.0),
    "huge": lambda rng, x: x.__setitem__((rng.integers(len(x)), rng.integers(x.shape[1])), 1e300),
}


@given(
    seed=st.integers(0, 10_000),
    spoilt=st.lists(st.sampled_from(sorted(spoilers)), max_size=6),
    count=st.integers(0, 400),
    gaps=st.lists(st.tuples(st.integers(0, 399), st.floats(0.0, 3.0)), max_size=4),
    memory=st.sampled_from([{}, {"forgetting_time": 2.0}, {"window": 3.0}]),
    settings=st.builds(
        Settings,
        method=st.sampled_from(["sls_rft", "iv_rft"]),
        settle_time=st.sampled_from([0.0, 0.5]),
        frequencies=st.sampled_from([(0.1, 0.04, 2.0), (0.3, 0.17, 1.7)]),
        use_prior=st.booleans(),
    ),
)
@hypothesis_settings(max_examples=40, deadline=None)
def test_any_record(
    seed: int,
    spoilt: list[str],
    count: int,
    gaps: list[tuple[int, float]],
    memory: dict[str, float],
    settings: Settings,
) -> None:
    rng = np.random.default_rng(seed)
    time = 0.02 * np.arange(400) + rng.uniform(0.0, 0.015, 400)
    samples = exact_flight(AIRCRAFT, time, seed % 7)
    for kind in spoilt:
        spoilers[kind](rng, samples)
    for at, length in gaps:
        time[at:] += length
    settings = replace(settings, **memory)
    assert_same(AIRCRAFT, settings, time[:count], samples[:count], np.arange(0.0, 12.0, 0.9))


def test_looks_between_renewals_change_estimates_from_then_on() -> None:
    """After 20 s of data some pieces are only looked at: what is wanted before a look leans on what was known then."""
    rng, time = np.random.default_rng(4), np.arange(0.0, 48.0, 1.0 / 50.0)
    other = replace(AIRCRAFT, mass=1.3 * AIRCRAFT.mass)
    before, after = (exact_flight(aircraft, time, 4) for aircraft in (AIRCRAFT, other))
    samples = np.where(time[:, None] < 36.0, before, after)
    samples[:, :9] *= 1.0 + 0.05 * rng.normal(size=(time.size, 9))
    found = assert_same(AIRCRAFT, Settings(), time, samples, np.arange(0.1, 48.0, 0.1))
    statuses = {d.status for estimates in found for d in estimates.derivatives.values() if estimates.time > 36.0}
    assert statuses - {"ok", "converging"}
