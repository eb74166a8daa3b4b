"""Estimates of whole methods with an aircraft that is not as its file says."""

from dataclasses import replace

import numpy as np
import pytest
from late_flight import LATE, UNCERTAIN, behind_servos
from made_flight import KESTREL, TRUTH, flight

from sysid_node.aircraft.model import UncertainValue
from sysid_node.batch.identify import METHODS, identify
from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.settings import BatchSettings
from sysid_node.batch.systematic.flight_posterior import flight_posterior
from sysid_node.batch.systematic.online_passes import OnlineEstimate, online_passes
from sysid_node.batch.systematic.systematic_errors import with_systematic_errors
from sysid_node.flight.logs.tables import with_commands


@pytest.fixture(scope="module")
def found():
    return identify("equation_error", UNCERTAIN, [behind_servos(1), behind_servos(2)], BatchSettings()).fit


@pytest.mark.slow
def test_servos_that_the_file_does_not_know(found):
    for name, servo in found.systematic.servos.items():
        assert servo.valid, name
        assert abs(servo.value - LATE) < 3.0 * servo.standard_error, name


@pytest.mark.slow
def test_servos_may_be_later_where_nothing_says_whether_commands_were_held(found):
    """The flights' own part is the same where commands are stated; what holding may add is in quadrature with it.

    By hand: half an interval of 50 Hz to both sides, of a rectangular distribution, 5.77 ms.
    """
    records = [with_commands(UNCERTAIN, behind_servos(seed), "commands") for seed in (1, 2)]
    stated = identify("equation_error", UNCERTAIN, records, BatchSettings(actuators="commands")).fit.systematic.servos
    for name, servo in found.systematic.servos.items():
        whole = np.hypot(stated[name].standard_error, 0.00577)
        assert servo.standard_error == pytest.approx(whole, rel=0.05), name


def test_intervals_hold_the_truth(found):
    off = {name: (e.value - TRUTH[name]) / e.standard_error for name, e in found.estimates.items() if name in TRUTH}
    assert max(map(abs, off.values())) < 3.0, off
    held = [e.lower <= TRUTH[name] <= e.upper for name, e in found.estimates.items()]
    assert np.mean(held) > 0.9


def test_without_servos_they_do_not():
    fit = equation_error(UNCERTAIN, [behind_servos(1), behind_servos(2)])
    off = [abs(e.value - TRUTH[name]) / e.standard_error for name, e in fit.estimates.items()]
    assert max(off) > 10.0


#: Over 5 s even for two states of one flight.
SLOW = ("filter_error", "extended_kalman_filter", "iterated_kalman_filter", "unscented_kalman_filter")


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_every_method_finds_the_truth_behind_servos_later_than_the_file_has_them(method):
    """A flight recorded by its commands; the file states servos of 30 +- 10 ms in place of 40 ms.

    The commands are linear between samples and taken as held, which is half a sample, 5 ms, later by itself.
    """
    if method in SLOW:
        pytest.skip(f"{method} takes more than 5 s")
    lags = {name: UncertainValue(0.03, 0.01) for name in UNCERTAIN.controls}
    file = replace(UNCERTAIN, effects={"actuator_lag": lags})
    record = with_commands(file, behind_servos(1), "commands")
    states = ("alpha", "q") if method == "output_error" else ()
    fit = identify(
        method, file, [record], BatchSettings(rate=50.0, segment=6.0, actuators="commands", states=states)
    ).fit
    for name, servo in fit.systematic.servos.items():
        assert servo.valid, name
        assert abs(servo.value - (LATE - 0.005)) < 3.0 * servo.standard_error, (name, servo)
        assert servo.standard_error < 0.005, name  # the flight shows it better than the file
    rows = {name: e for name, e in fit.estimates.items() if name in TRUTH and e.valid}
    assert len(rows) >= (8 if states else 20)
    assert all(e.lower <= TRUTH[name] <= e.upper for name, e in rows.items())
    assert any("actuator_lag" in key for shares in fit.systematic.budget.values() for key in shares)


def test_intervals_hold_steps_that_a_slow_log_tells_too_late():
    """Truth: a flight whose elevator was logged 30 ms late, within the 0.1 s between the log's commands."""
    record = flight(1)
    late = record.columns | {"de": np.interp(record.time - 0.03, record.time, record["de"])}
    logged = replace(record, columns=late, commanded=True)
    for interval, holds in ((0.0, False), (0.1, True)):
        slow = replace(logged, command_interval=interval)
        fit = identify("equation_error", KESTREL, [slow], BatchSettings(actuators="commands")).fit
        found = fit.estimates["Cm_q"]
        assert found.valid == holds, (interval, found)
        assert not found.valid or found.lower <= TRUTH["Cm_q"] <= found.upper, (interval, found)


def test_parts_of_the_standard_error_and_the_budget(found):
    for name, e in found.estimates.items():
        assert e.standard_error == pytest.approx(np.hypot(e.statistical_error, e.systematic_error)), name
        shares = found.systematic.budget[name]
        assert list(shares.values()) == sorted(shares.values(), reverse=True)
        assert shares.get("statistical", 0.0) == pytest.approx((e.statistical_error / e.standard_error) ** 2, abs=0.006)
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx([e.standard_error for e in found.estimates.values()])


def test_a_mass_that_is_uncertain_is_a_share_of_the_lift():
    file = replace(KESTREL, stated_tolerances={"mass": 0.02 * KESTREL.mass})
    fit = identify("equation_error", file, [flight(1)], BatchSettings(actuators="positions")).fit
    lift = fit.estimates["CL_alpha"]
    # of the aerodynamic force alone: the thrust's part of the measured one does not grow with the mass
    assert lift.systematic_error == pytest.approx(0.02 * abs(lift.value), rel=0.1)
    assert fit.estimates["Cm_q"].systematic_error < 1e-6


@pytest.mark.parametrize(("off", "valid"), [(1.9, True), (2.1, False)])
def test_what_the_online_estimator_contradicts_is_not_valid(off, valid):
    posterior = flight_posterior(online_passes(UNCERTAIN, [behind_servos(1)], BatchSettings()))
    assert posterior is not None
    fit = equation_error(KESTREL, [flight(1)])
    own = fit.estimates["Cm_de"]
    online = OnlineEstimate(own.value + off * np.hypot(own.standard_error, 0.01), 0.01, 0.01, "ok", 0.0)
    still = replace(posterior, mean=0.0 * posterior.mean, covariance=0.0 * posterior.covariance)
    found = with_systematic_errors(
        UNCERTAIN, [flight(1)], fit, still, lambda _: np.zeros(len(fit.estimates)), {"Cm_de": online}, models_gusts=True
    )
    assert found.estimates["Cm_de"].valid == valid
    assert found.estimates["Cm_de"].status.startswith("contradicted") != valid


def test_an_exact_file_gives_the_method_alone():
    fit = identify("equation_error", KESTREL, [flight(1)], BatchSettings()).fit
    alone = equation_error(KESTREL, [flight(1)])
    assert fit.values == alone.values
    assert not fit.systematic.servos
    assert not fit.systematic.budget
