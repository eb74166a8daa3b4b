"""What the identifier says on /diagnostics, without a node."""

import math

import pytest

from sysid_node.flight.live.monitor import Durations, TopicMonitor
from sysid_node.flight.live.recent_counts import RecentCounts
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality
from sysid_node.ros.support.diagnostics import ERROR, OK, STALE, WARN, DiagnosticSource

SOURCE = DiagnosticSource("identifier", "cdrw")


def values(status) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


def heard(name: str, count: int = 1) -> TopicMonitor:
    monitor = TopicMonitor(name)
    for _ in range(count):
        monitor.arrived()
    return monitor


def test_all_is_well() -> None:
    status = SOURCE.input([heard("imu/data", 3), heard("air_data")], {}, 60.0)
    assert (status.level, status.name, status.hardware_id) == (OK, "identifier: input", "cdrw")
    assert status.message == "all topics arrive"
    assert values(status)["imu/data: received"] == "3"


def test_what_never_came_is_named() -> None:
    status = SOURCE.input([heard("imu/data"), TopicMonitor("air_data")], {}, 60.0)
    assert (status.level, status.message) == (STALE, "air_data never received")


def test_silence_is_named() -> None:
    status = SOURCE.input([heard("imu/data")], {}, -1.0)
    assert status.level == STALE
    assert status.message.startswith("imu/data silent for 0.0 s")


def test_rejected_messages_are_counted_by_reason() -> None:
    rejected = {"imu/data: duplicate stamp": 2, "imu/data: no stamp": 7}
    imu = heard("imu/data", 100)
    status = SOURCE.input([imu], rejected, 60.0, RecentCounts().update([imu], rejected))
    assert status.level == WARN
    assert "imu/data: 9 of 100 messages rejected, most as no stamp" in status.message
    assert values(status)["rejected, imu/data: duplicate stamp"] == "2"


@pytest.mark.parametrize(("count", "level"), [(1, OK), (30, WARN), (200, ERROR)])
def test_one_bad_message_is_not_the_same_as_all(count: int, level: bytes) -> None:
    imu, rejected = heard("imu/data", 200), {"imu/data: not finite": count}
    imu.resolved = "/uav1/imu/data"
    status = SOURCE.input([imu], rejected, 60.0, RecentCounts().update([imu], rejected))
    assert status.level == level
    assert status.message.startswith("/uav1/imu/data: ")


@pytest.mark.parametrize("received", [2, 20])
def test_the_first_messages_without_neighbours_in_other_topics_are_no_trouble(received: int) -> None:
    imu, rejected = heard("imu/data", received), {"imu/data: air_data gap": 2}
    assert SOURCE.input([imu], rejected, 60.0, RecentCounts().update([imu], rejected)).level == OK


def test_a_clock_that_was_set_is_said_although_it_costs_one_message() -> None:
    imu, rejected = heard("imu/data", 2000), {"imu/data: clock step": 1}
    status = SOURCE.input([imu], rejected, 60.0, RecentCounts().update([imu], rejected))
    assert status.level == WARN
    assert "was the clock set, or did a recording begin anew? The record goes on after a break" in status.message


@pytest.mark.parametrize(
    ("reason", "remedy"),
    [
        ("no stamp", "have the driver put the time of measurement into the header"),
        ("duplicate stamp", "does the topic have two publishers, or a driver that repeats messages?"),
        ("out of order", "does the topic have two publishers, with clocks that differ?"),
    ],
)
def test_stamps_that_cannot_be_used_are_said_with_what_to_do(reason: str, remedy: str) -> None:
    imu, rejected = heard("imu/data", 100), {f"imu/data: {reason}": 100}
    status = SOURCE.input([imu], rejected, 60.0, RecentCounts().update([imu], rejected))
    assert f"all of 100 messages rejected, most as {reason}: {remedy}" in status.message


def test_what_was_rejected_at_the_start_is_forgotten_after_ten_seconds() -> None:
    now = [0.0]
    imu, recent, levels = TopicMonitor("imu/data"), RecentCounts(lambda: now[0]), []
    for second in range(15):
        now[0] = float(second)
        for _ in range(20):
            imu.arrived()
        rejected = {"imu/data: no stamp": 20}  # all of the first second's
        levels.append(SOURCE.input([imu], rejected, 60.0, recent.update([imu], rejected)).level)
    assert levels[0] == ERROR
    assert levels[5] == WARN
    assert levels[12:] == [OK, OK, OK]


@pytest.mark.parametrize(
    ("reason", "remedy"),
    [
        ("air_data gap", ": /uav1/air_data must come at least every 0.2 s (max_gap), stamped by the same clock"),
        ("x", ""),
    ],
)
def test_gaps_in_another_topic_are_said_with_what_to_do(reason: str, remedy: str) -> None:
    topics = [TopicMonitor("imu/data", resolved="/uav1/imu/data"), TopicMonitor("air_data", resolved="/uav1/air_data")]
    for _ in range(10):
        topics[0].arrived()
        topics[1].arrived()
    recent = RecentCounts()
    lately = recent.update(topics, {f"imu/data: {reason}": 10})
    status = SOURCE.input(topics, {}, 60.0, lately, max_gap=0.2)
    assert status.message == f"/uav1/imu/data: all of 10 messages rejected, most as {reason}{remedy}"


def test_unlikely_readings_are_an_error() -> None:
    status = SOURCE.input([], {}, 0.5, wrong_readings=("", "sideslip: no change for 10 s"))
    assert (status.level, status.message) == (ERROR, "sideslip: no change for 10 s")
    assert SOURCE.input([], {}, 0.5, wrong_readings=("", "")).level == OK


def test_what_may_be_wrong_is_a_warning() -> None:
    status = SOURCE.input([], {}, 0.5, doubt="is the airspeed in m/s?")
    assert (status.level, status.message) == (WARN, "is the airspeed in m/s?")


@pytest.mark.parametrize(("lag", "level"), [(0.02, OK), (0.8, WARN), (4.0, ERROR), (-1.0, WARN), (1e8, OK)])
def test_lateness_has_a_level(lag: float, level: bytes) -> None:
    """It said OK at 4 s."""
    estimates = Estimates(3.0, {"CL_q": DerivativeEstimate("CL_q", 3.0, 0.1, 2.8, 3.2, True, "ok")}, {})
    assert SOURCE.computation({}, lag).level == level
    assert SOURCE.estimate(estimates, 600, lag).level == level


def test_a_silence_is_no_lateness_and_no_other_clock() -> None:
    status = SOURCE.computation({}, 0.02, silence=70.0)
    assert (status.level, status.message) == (
        WARN,
        "no sample for 70.0 s; before, last estimate 20.0 ms after its sample",
    )


def test_before_the_first_estimate_it_says_so() -> None:
    assert (SOURCE.waits("estimate").level, SOURCE.waits("estimate").name) == (WARN, "identifier: estimate")
    assert "no estimate yet" in SOURCE.waits("estimate").message


@pytest.mark.parametrize(("fault", "level", "message"), [("", OK, "active"), ("boom", ERROR, "active: boom")])
def test_a_fault_is_an_error(fault: str, level: bytes, message: str) -> None:
    status = SOURCE.state("active", fault, 1)
    assert (status.level, status.message) == (level, message)


def test_derivatives_are_grouped_by_what_is_wrong_with_them() -> None:
    estimates = Estimates(
        3.0,
        {
            "CL_alpha": DerivativeEstimate("CL_alpha", 3.0, 0.1, 2.8, 3.2, True, "ok"),
            "Cl_p": DerivativeEstimate("Cl_p", 0.4, 0.5, -0.6, 1.4, False, "not excited"),
            "Cn_r": DerivativeEstimate("Cn_r", math.nan, math.inf, -math.inf, math.inf, False, "not excited"),
        },
        {"CL": FitQuality("CL", 0.9, 0.01, 20.0, 600)},
    )
    status = SOURCE.estimate(estimates, 600, actuators="commands")
    assert (status.level, status.message) == (OK, "1 of 3 derivatives valid")
    assert values(status)["actuators carry"] == "commands"
    assert values(status)["not excited"] == "Cl_p Cn_r"
    assert values(status)["R^2 of CL"] == "0.9"


def test_times_are_told_by_their_percentiles() -> None:
    durations = Durations()
    assert all(map(math.isnan, durations.percentiles()))
    for i in range(100):
        durations.add(i * 1e-6)
    status = SOURCE.computation({"update": durations}, 0.002)
    assert status.message == "last estimate 2.0 ms after its sample"
    assert values(status)["update p50 (us)"] == "50"
    assert values(status)["update p99 (us)"] == "99"


def test_a_replay_has_no_lag_worth_telling() -> None:
    said = "last estimate with stamps of another clock, by which its delay is not known"
    assert SOURCE.computation({}, 1e8).message == said


def test_a_rate_is_over_the_time_since_it_was_last_asked_for() -> None:
    now = [100.0]
    monitor = TopicMonitor("imu/data", lambda: now[0])
    for _ in range(40):
        now[0] += 0.05
        monitor.arrived()
    assert monitor.rate() == pytest.approx(20.0)
    now[0] += 1.0
    assert monitor.rate() == 0.0
    assert monitor.silence() == pytest.approx(1.0)
