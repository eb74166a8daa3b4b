"""Statuses as numbers and as words, and what is decided of them at every sample."""

from dataclasses import replace

import numpy as np
import pytest
from plant import exact_flight, fly, made_aircraft, multisteps

from sysid_node.online import estimator, status
from sysid_node.online.estimates.current_solution import current_solution
from sysid_node.online.estimates.published import estimate, estimate_of
from sysid_node.online.estimates.validity import SETTLING, STALE, judge
from sysid_node.online.regression.normal_equations import model_structure
from sysid_node.online.settings import METHODS, OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.status import vocabulary

AIRCRAFT = made_aircraft()
STRUCTURE = model_structure(AIRCRAFT.model_structure)


def flown(seconds: float, method: str = "iv_rft") -> EstimatorState:
    """The state after 3-2-1-1s in light turbulence."""
    time, flights = fly(AIRCRAFT, multisteps(seconds, 100.0), gusts=0.5, closed_loop=False)
    state = estimator.init(AIRCRAFT, OnlineSettings(method=method))
    for t, sample in zip(time.tolist(), flights[0].tolist(), strict=True):
        estimator.update(state, t, sample)
    return state


def test_every_number_has_its_word() -> None:
    words = vocabulary(AIRCRAFT, STRUCTURE)
    assert words.words[status.OK] == "ok"
    assert words.words[status.INERTIA] == "inertia unknown"
    assert words.words[words.collinear + STRUCTURE.regressors.index("beta")] == "collinear with beta"
    assert words.code("dr not on time") == len(words.words) - 1
    assert len(words.words) < 256, "they are kept in bytes"
    codes = np.array([status.STALE, status.OK], np.uint8)
    assert words.texts(codes) == ("stale input", "ok")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seconds", [3.0, 8.0, 25.0])
def test_what_is_decided_at_a_sample_is_what_is_published_of_it(method: str, seconds: float) -> None:
    state = flown(seconds, method)
    current, latest = current_solution(state), state.latest
    assert current is not None and latest is not None
    codes = judge(state, latest, current, state.transform.last)
    told = estimate(state).derivatives
    assert state.model.vocabulary.texts(codes) == tuple(d.status for d in told.values())
    assert [code == status.OK for code in codes.tolist()] == [d.valid for d in told.values()]
    np.testing.assert_array_equal(current.values, [d.value for d in told.values()])
    np.testing.assert_array_equal(np.sqrt(current.variances), [d.standard_error for d in told.values()])


def test_what_holds_of_a_moment_holds_of_all_estimates() -> None:
    state = flown(12.0)
    current, latest, last = current_solution(state), state.latest, state.transform.last
    assert current is not None and latest is not None
    assert set(judge(state, latest, current, last + 1.01 * STALE)) == {status.STALE}
    state.changes.changed_at = last - 0.99 * SETTLING
    assert set(judge(state, latest, current, last)) == {status.CHANGED}


def test_intervals_without_an_end_are_not_valid() -> None:
    """However small the standard error is said to be that is allowed."""
    state = flown(25.0)
    current, latest = current_solution(state), state.latest
    assert current is not None and latest is not None
    good = judge(state, latest, current, state.transform.last) == status.OK
    assert good.any()
    unbounded = latest.instruments.anderson_rubin._replace(curve=np.full(good.shape, 1e12))
    latest.instruments = replace(latest.instruments, anderson_rubin=unbounded)
    latest.basis = None
    assert not (judge(state, latest, current, state.transform.last) == status.OK).any()
    assert all(np.isinf(d.upper) for d in estimate_of(state, current).derivatives.values())


def test_where_equations_cannot_be_solved_nothing_is_excited() -> None:
    """Nothing moves at all: no line has any energy."""
    time = np.arange(0.0, 3.0, 0.01)
    still = np.tile(exact_flight(AIRCRAFT, time[:2])[:1], (time.size, 1))
    state = estimator.init(AIRCRAFT, OnlineSettings(method="sls_rft"))
    for t, sample in zip(time.tolist(), still.tolist(), strict=True):
        estimator.update(state, t, sample)
    current, latest = current_solution(state), state.latest
    assert current is not None and latest is not None
    current.solution.usable = np.array(False)
    assert set(judge(state, latest, current, state.transform.last)) == {status.NOT_EXCITED}
