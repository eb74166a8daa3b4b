"""The estimator takes whatever comes: no exception, and nothing valid that is nonsense."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from plant import TRUTH, exact_flight, made_aircraft

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Derivative
from sysid_node.errors import InputError
from sysid_node.online import estimator
from sysid_node.online.alignment import streaming
from sysid_node.online.estimates.current_solution import current_solution
from sysid_node.online.estimates.model_gap import model_gap
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import METHODS, OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.types import SAMPLE_COLUMNS

AIRCRAFT = made_aircraft()
TIME = np.arange(0.0, 6.0, 0.02)
SAMPLES = exact_flight(AIRCRAFT, TIME)
WIDTH = SAMPLES.shape[1]
anything = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e-200, 1e200, -1e308, 1e9, 57.3]), st.floats()
)


def assert_sound(state: EstimatorState) -> None:
    """What is marked valid is a finite value inside a finite interval of positive length."""
    for d in estimate(state).derivatives.values():
        assert d.valid == (d.status == "ok")
        if d.valid:
            assert all(map(math.isfinite, d[1:5])), d
            assert d.lower < d.value < d.upper
            assert d.standard_error > 0.0
    model_gap(state, current_solution(state))


def flown(samples: Sequence[Sequence[float]], times: Sequence[float], method: str = "iv_rft") -> EstimatorState:
    """The state after the samples; numerical warnings count as errors."""
    state = estimator.init(AIRCRAFT, OnlineSettings(method=method, settle_time=0.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for time, sample in zip(times, samples, strict=True):
            estimator.update(state, time, sample)
        assert_sound(state)
    return state


def left_out(state: EstimatorState) -> int:
    """Samples that were counted as left out."""
    return sum(state.inputs.incomplete.values())


@pytest.mark.slow
@given(
    st.lists(st.tuples(st.integers(0, len(TIME) - 1), st.integers(0, WIDTH - 1), anything), max_size=40),
    st.sampled_from(METHODS),
)
@hypothesis_settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_any_values(spoilt: list[tuple[int, int, float]], method: str) -> None:
    samples = SAMPLES.tolist()
    for row, column, value in spoilt:
        samples[row][column] = value
    assert left_out(flown(samples, TIME.tolist(), method)) <= len({row for row, _, _ in spoilt})


@given(st.lists(st.tuples(st.integers(0, len(TIME) - 1), anything), max_size=40))
@hypothesis_settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@example([(0, math.nan), (1, math.inf), (2, -math.inf), (50, 1e200)])
def test_any_times(spoilt: list[tuple[int, float]]) -> None:
    """Repeated, shuffled, absent and absurd times: left out, and the flight goes on where they are bearable."""
    times = TIME.tolist()
    for row, time in spoilt:
        times[row] = time
    state = flown(SAMPLES.tolist(), times)
    assert (
        math.isnan(state.inputs.begin)
        or state.inputs.previous is None
        or abs(state.inputs.previous[0]) < estimator.LIMIT
    )


@given(st.permutations(range(60)), st.sampled_from(METHODS))
@hypothesis_settings(max_examples=15, deadline=None)
def test_any_order(order: list[int], method: str) -> None:
    rows = [*range(200), *(200 + i for i in order)]
    state = flown(SAMPLES[rows].tolist(), TIME[rows].tolist(), method)
    newest = np.maximum.accumulate(TIME[rows])
    assert left_out(state) == np.count_nonzero(newest[1:] == newest[:-1])


@given(st.lists(st.lists(anything, min_size=WIDTH, max_size=WIDTH), max_size=30))
@hypothesis_settings(max_examples=30, deadline=None)
def test_nothing_but_nonsense(samples: list[list[float]]) -> None:
    state = flown(samples, [0.1 * i for i in range(len(samples))])
    assert not any(d.valid for d in estimate(state).derivatives.values())


@given(st.data())
@hypothesis_settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_any_messages(data: st.DataObject) -> None:
    """Messages with any values and stamps through the intake, as the node and the replay feed them."""
    door = streaming.init(AIRCRAFT, 0.2)
    state = estimator.init(AIRCRAFT, OnlineSettings(settle_time=0.0))
    stamps = (1_000_000_000 + np.round(TIME * 1e9)).astype(int).tolist()
    odd = dict(data.draw(st.lists(st.tuples(st.integers(0, len(TIME) - 1), st.integers(-(10**9), 10**18)), max_size=8)))
    wrong = dict(data.draw(st.lists(st.tuples(st.integers(0, len(TIME) - 1), anything), max_size=8)))
    names = tuple(AIRCRAFT.controls)
    for i, (regular, sample) in enumerate(zip(stamps, SAMPLES.tolist(), strict=True)):
        stamp, values = odd.get(i, regular), [wrong.get(i, sample[0]), *sample[1:]]
        complete = streaming.on_imu(door, stamp, tuple(values[:6]))
        complete += streaming.on_air_data(door, stamp, tuple(wrong.get(i, x) for x in values[6:10]))
        complete += streaming.on_actuators(door, stamp, (*names, "throttle"), [*values[12:], 0.2])
        for time, aligned, _ in complete:
            estimator.update(state, time, aligned)
    assert_sound(state)


def test_what_is_left_out_is_counted_by_its_column() -> None:
    samples = SAMPLES.tolist()
    samples[100][SAMPLE_COLUMNS.index("alpha")] = math.nan
    samples[101][SAMPLE_COLUMNS.index("alpha")] = 1e200
    samples[102][SAMPLE_COLUMNS.index("V")] = 0.0
    samples[103][SAMPLE_COLUMNS.index("rho")] = -1.0
    samples[104][len(SAMPLE_COLUMNS)] = math.inf
    times = TIME.tolist()
    times[105] = times[99]
    times[106] = math.inf
    state = flown(samples, times)
    assert state.inputs.incomplete == {"alpha": 2, "V": 1, "rho": 1, "de": 1, "time": 2}


def test_nonsense_in_the_middle_leaves_the_estimates_alone() -> None:
    samples = SAMPLES.tolist()
    for row in range(120, 125):
        samples[row] = [1e300] * WIDTH
    spoilt = estimate(flown(samples, TIME.tolist(), "sls_rft")).derivatives
    clean = estimate(flown(SAMPLES.tolist(), TIME.tolist(), "sls_rft")).derivatives
    for name in TRUTH:
        assert spoilt[name].value == pytest.approx(clean[name].value, rel=2e-2, abs=1e-3)


def test_a_long_silence_is_not_bridged() -> None:
    """A gap of a minute, at another trim: what lies in between is not made up."""
    later = exact_flight(AIRCRAFT, TIME, seed=3, alpha=0.14)
    state = flown([*SAMPLES.tolist(), *later.tolist()], [*TIME.tolist(), *(TIME + 66.0).tolist()], "sls_rft")
    found = estimate(state)
    for name in ("CL_alpha", "Cm_alpha", "Cm_de", "Cl_p", "Cn_beta"):
        assert found.derivatives[name].value == pytest.approx(TRUTH[name], rel=2e-3)
    assert found.fits["Cm"].samples == pytest.approx(2 * len(TIME), abs=60)


def test_settling_counts_from_the_first_sample() -> None:
    state = estimator.init(AIRCRAFT, OnlineSettings(settle_time=2.0))
    for time, sample in zip((TIME + 50.0).tolist(), SAMPLES.tolist(), strict=True):
        estimator.update(state, time, sample)
        if time < 52.0:
            assert state.inputs.previous is None
    assert state.segment.start >= 52.0


def test_a_model_of_offsets_alone_is_refused() -> None:
    aircraft = replace(AIRCRAFT, derivatives={"CL_0": Derivative(0.1), "Cm_0": Derivative(0.0)})
    with pytest.raises(InputError, match="at least one besides offsets"):
        estimator.init(aircraft, OnlineSettings())


@pytest.mark.parametrize(
    "settings", [OnlineSettings(window=10.0), OnlineSettings(forgetting_time=5.0)], ids=["window", "fading"]
)
def test_what_was_flown_long_ago_is_forgotten(settings: OnlineSettings) -> None:
    """The elevator's effect changes without a test for changes: after five memories the new one alone is known."""
    changed = made_aircraft({**TRUTH, "Cm_de": 0.6 * TRUTH["Cm_de"]})
    time = np.arange(0.0, 60.0, 0.02)
    samples = np.vstack([exact_flight(AIRCRAFT, time[:1500]), exact_flight(changed, time[1500:], 4)])
    blind = replace(settings, detect_changes=False, method="sls_rft")
    state = estimator.init(AIRCRAFT, blind)
    for t, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, t, sample)
    assert estimate(state).derivatives["Cm_de"].value == pytest.approx(0.6 * TRUTH["Cm_de"], rel=0.02)
    assert len(state.finished.in_window) <= 6


def test_a_window_holds_no_more_than_its_length_after_an_interruption() -> None:
    """All segments from before an interruption longer than the window are left behind at once."""
    time = np.arange(0.0, 45.0, 0.02)
    late = np.where(time > 40.0, time + 100.0, time)
    state = estimator.init(AIRCRAFT, OnlineSettings(window=20.0, detect_changes=False))
    for t, sample in zip(late.tolist(), exact_flight(AIRCRAFT, time).tolist(), strict=True):
        estimator.update(state, t, sample)
        if state.latest is not None and t > 142.0:
            assert state.latest.total.energy < t - 140.0 + 1.0


def test_an_angle_that_cannot_be_reconstructed_is_reported() -> None:
    """Without vanes, and without the lift slope by which the file would tell the angle of attack."""
    aircraft = load_aircraft("cdrw")  # with the default tolerances, of which that of the mean angle is one
    known = {name: d for name, d in aircraft.derivatives.items() if name != "CL_alpha"}
    samples = SAMPLES.copy()
    samples[:, [SAMPLE_COLUMNS.index("alpha"), SAMPLE_COLUMNS.index("beta")]] = math.nan
    state = estimator.init(replace(aircraft, derivatives=known), OnlineSettings())
    for time, sample in zip(TIME.tolist(), samples.tolist(), strict=True):
        estimator.update(state, time, sample)
    assert {d.status for d in estimate(state).derivatives.values()} == {"alpha not measured"}


@pytest.mark.parametrize("factor", [-1.0, 1.0 / 9.80665], ids=["reversed", "in g"])
def test_with_other_axes_or_units_nothing_is_valid(factor: float) -> None:
    """The same flight read in other axes or units fits as well, with derivatives of the wrong sign or size."""
    time = np.arange(0.0, 20.0, 0.02)
    samples = exact_flight(AIRCRAFT, time)
    found = []
    for scale in (1.0, factor):
        state = estimator.init(AIRCRAFT, OnlineSettings(method="sls_rft"))
        for t, sample in zip(time.tolist(), samples.tolist(), strict=True):
            sample[2] *= scale
            estimator.update(state, t, sample)
        found.append(estimate(state).derivatives)
    right, wrong = found
    assert right["CL_alpha"].valid
    assert {d.status for d in wrong.values()} == {"outside model"}


@pytest.mark.parametrize(("column", "concerned"), [("ay", {"CY"}), ("beta", {"CL", "CD", "CY", "Cl", "Cm", "Cn"})])
def test_what_depends_on_a_reading_that_stands_still_is_not_valid(column: str, concerned: set[str]) -> None:
    """An accelerometer that reads zero fits derivatives of zero perfectly, each with a narrow interval."""
    time = np.arange(0.0, 20.0, 0.02)
    samples = exact_flight(AIRCRAFT, time)
    samples[:, SAMPLE_COLUMNS.index(column)] = 0.0
    state = estimator.init(AIRCRAFT, OnlineSettings(method="sls_rft"))
    for t, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, t, sample)
    found = estimate(state).derivatives
    assert {name.partition("_")[0] for name, d in found.items() if d.status == "stale input"} == concerned
    assert {name for name, d in found.items() if d.valid and name.partition("_")[0] in concerned} == set()


def test_memory_does_not_grow() -> None:
    """Containers after two minutes are no longer than after one."""
    time = np.arange(0.0, 120.0, 0.05)
    samples = exact_flight(AIRCRAFT, time)
    state = estimator.init(AIRCRAFT, OnlineSettings(window=20.0))
    sizes = []
    for i, (t, sample) in enumerate(zip(time.tolist(), samples.tolist(), strict=True)):
        estimator.update(state, t, sample)
        if i in (1199, 2399):
            change_monitor = state.changes.monitor
            sizes.append(
                [
                    len(state.finished.in_window),
                    len(change_monitor.pieces),
                    len(change_monitor.references),
                    len(change_monitor.typical_statistic),
                ]
            )
    assert sizes[0] == sizes[1]
