"""A recording through the monitor: in ``bags/cdrw_failed_elevator`` the elevator loses half its effect at 30 s."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.faults import watch as watching
from sysid_node.faults.recorded_flight import FaultReport, FaultVerdict, episodes, judge
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import LOSS, NOT_FOLLOWING, SILENT, STUCK, Fault
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.commands import JointMessage
from sysid_node.flight.streams import Stream, Streams

AIRCRAFT = load_aircraft("cdrw")
BAGS = Path(__file__).resolve().parents[2] / "bags"


@pytest.fixture(scope="module")
def flight() -> Streams:
    return read_streams(BAGS / "cdrw_failed_elevator")


@pytest.fixture(scope="module")
def verdict(flight: Streams) -> FaultVerdict:
    return judge(AIRCRAFT, FaultMonitorSettings(), flight)


def shortened(flight: Streams, begin: float, end: float) -> Streams:
    """The messages recorded between two times, s."""
    start = int(flight.imu.arrival.log_ns[0])

    def cut(stream: Stream, **values: np.ndarray) -> dict:
        seconds = (stream.arrival.log_ns - start) / 1e9
        chosen = (seconds >= begin) & (seconds < end)
        arrival = dataclasses.replace(
            stream.arrival,
            **{f.name: getattr(stream.arrival, f.name)[chosen] for f in dataclasses.fields(stream.arrival)},
        )
        return {"arrival": arrival, **{name: value[chosen] for name, value in values.items()}}

    imu, air, joints = flight.imu, flight.air_data, flight.actuators
    return Streams(
        dataclasses.replace(imu, **cut(imu, values=imu.values, attitude=imu.attitude)),
        dataclasses.replace(air, **cut(air, values=air.values)),
        dataclasses.replace(joints, **cut(joints, positions=joints.positions)),
    )


@pytest.mark.slow
def test_the_failure_that_was_flown_is_found(verdict: FaultVerdict) -> None:
    (episode,) = verdict.episodes
    fault = episode.fault
    assert (fault.kind, fault.part, episode.until) == (LOSS, "elevator", None)
    assert fault.lower <= 0.5 <= fault.upper
    assert 30.0 < fault.found < 36.0
    assert 36.0 < verdict.judged < 40.0


@pytest.mark.slow
def test_air_data_that_fail_for_ten_seconds_while_it_learns_are_no_damage() -> None:
    """Nothing failed in this flight; what came after the outage had been compared with what was never learned."""
    streams = read_streams(BAGS / "cdrw_multistep")
    values = streams.air_data.values.copy()
    seconds = (streams.air_data.arrival.log_ns - streams.imu.arrival.log_ns[0]) / 1e9
    values[(seconds > 10.0) & (seconds < 20.0), 1] = np.nan
    found = judge(
        AIRCRAFT,
        FaultMonitorSettings(),
        dataclasses.replace(streams, air_data=dataclasses.replace(streams.air_data, values=values)),
    )
    assert not found.episodes
    assert 15.0 < found.judged < 25.0


@pytest.mark.slow
def test_it_is_what_the_live_functions_say_message_by_message(flight: Streams, verdict: FaultVerdict) -> None:
    """In the order of arrival, with a look every tenth of a second: the same, to the last bit."""
    watch, speech, said = watching.init(AIRCRAFT, FaultMonitorSettings(), 0.5), watching.Announcements(), []
    start = int(flight.imu.arrival.log_ns[0])
    calls = [
        *((s, i, watching.on_imu, ()) for s in [flight.imu] for i in range(len(s.arrival))),
        *((s, i, watching.on_air_data, ()) for s in [flight.air_data] for i in range(len(s.arrival))),
        *((s, i, watching.on_actuators, (s.names,)) for s in [flight.actuators] for i in range(len(s.arrival))),
    ]
    tick = 1
    for stream, i, take, names in sorted(calls, key=lambda call: call[0].arrival.order[call[1]]):
        now = (int(stream.arrival.log_ns[i]) - start) / 1e9
        while 0.1 * tick < now:
            faults = watching.present_faults(watch, 0.1 * tick)
            if speech.due(faults, 0.1 * tick):
                said.append(FaultReport(watch.stamp_ns, watch.now, tuple(faults)))
            tick += 1
        values = stream.positions if names else stream.values
        take(watch, now, int(stream.arrival.stamp_ns[i]), *names, tuple(values[i].tolist()))
    assert [moment.stamp_ns for moment in said] == [moment.stamp_ns for moment in verdict.reports]
    assert [[f.text for f in moment.faults] for moment in said] == [[f.text for f in m.faults] for m in verdict.reports]


def test_what_is_silent_and_what_does_not_follow(flight: Streams) -> None:
    """Air data stop for 2 s; the rudder does not follow for a second, and then it does."""
    short = shortened(flight, 0.0, 12.0)
    arrival = short.air_data.arrival
    heard = ~((arrival.log_ns > arrival.log_ns[0] + 4e9) & (arrival.log_ns < arrival.log_ns[0] + 6e9))
    fields = {f.name: getattr(arrival, f.name)[heard] for f in dataclasses.fields(arrival)}
    air = dataclasses.replace(
        short.air_data, arrival=dataclasses.replace(arrival, **fields), values=short.air_data.values[heard]
    )
    place = short.actuators.names.index("rudder")
    positions = short.actuators.positions.copy()
    seconds = (short.actuators.arrival.log_ns - int(short.actuators.arrival.log_ns[0])) / 1e9
    positions[:, place] += 0.025 * np.clip(seconds - 9.0, 0.0, 1.0)  # what stands still is not seen to follow
    joints = dataclasses.replace(short.actuators, positions=positions)
    commands = []
    for log_ns, stamp_ns, row in zip(
        joints.arrival.log_ns.tolist(), joints.arrival.stamp_ns.tolist(), joints.positions.tolist(), strict=True
    ):
        told = list(row)
        told[place] += 0.2 * (8.0 < (log_ns - int(joints.arrival.log_ns[0])) / 1e9 < 9.0)
        commands.append(JointMessage(log_ns, stamp_ns, joints.names, tuple(told)))
    found = judge(
        AIRCRAFT, FaultMonitorSettings(), dataclasses.replace(short, air_data=air, actuators=joints), commands
    ).episodes
    assert [(e.fault.kind in {SILENT, STUCK, NOT_FOLLOWING}, e.fault.part) for e in found] == [
        (True, "air_data"),
        (True, "rudder"),
    ]
    silent, off = found
    assert silent.fault.since == pytest.approx(4.0, abs=0.1)
    assert silent.until == pytest.approx(6.0, abs=0.2)
    assert off.fault.since == pytest.approx(8.0, abs=0.3)
    assert 9.0 < off.until < 10.6  # a second in which it follows ends it


def test_a_fault_whose_name_changes_is_one_and_two_silences_are_two() -> None:
    def one(kind: str, part: str, found: float, source: str = "forces") -> Fault:
        return Fault(kind, part, 0.1, 0.0, 0.2, "1", found - 1.0, found, 0.9, source=source)

    said = [
        FaultReport(1, 10.0, (one("stuck surface", "elevator", 10.0),)),
        FaultReport(2, 10.5, (one(LOSS, "elevator", 10.0), one(SILENT, "air_data", 10.4, "arrival"))),
        FaultReport(3, 11.0, (one(LOSS, "elevator", 10.0), one(SILENT, "imu/data", 10.4, "arrival"))),
        FaultReport(4, 12.0, ()),
        FaultReport(5, 20.0, (one(LOSS, "rudder", 20.0),)),
    ]
    assert [(e.fault.kind, e.fault.part, e.until) for e in episodes(said)] == [
        (LOSS, "elevator", 12.0),
        (SILENT, "air_data", 11.0),
        (SILENT, "imu/data", 12.0),
        (LOSS, "rudder", None),
    ]


def test_a_flight_too_short_to_learn_says_so(flight: Streams) -> None:
    verdict = judge(AIRCRAFT, FaultMonitorSettings(), shortened(flight, 0.0, 6.0))
    assert (verdict.judged, verdict.episodes) == (0.0, [])
    assert "too short, or has too many gaps, to learn" in verdict.sentences[0]


def test_a_jump_of_the_recorders_clock_from_1970_to_today_takes_no_time(flight: Streams) -> None:
    """The monitor looked every 0.2 s of the recorder's clock: 9e9 times in 56 years."""
    some = shortened(flight, 0.0, 4.0)

    def set_clock(stream: Stream) -> Stream:
        log_ns = stream.arrival.log_ns - some.imu.arrival.log_ns[0]
        log_ns = log_ns + np.where(log_ns > 2 * 10**9, 56 * 365 * 86400 * 10**9, 0)
        return dataclasses.replace(stream, arrival=dataclasses.replace(stream.arrival, log_ns=log_ns))

    jumping = Streams(set_clock(some.imu), set_clock(some.air_data), set_clock(some.actuators), some.name)
    assert judge(AIRCRAFT, FaultMonitorSettings(), jumping).judged < 10.0


def test_readings_that_never_change_are_judged_without_a_failure(flight: Streams) -> None:
    """Residuals without any noise have a variance of zero, by which nothing may be divided."""
    imu, air, joints = flight.imu, flight.air_data, flight.actuators
    still = [np.broadcast_to(values[0], values.shape) for values in (imu.values, air.values, joints.positions)]
    dead = Streams(
        dataclasses.replace(imu, values=still[0], attitude=np.broadcast_to(imu.attitude[0], imu.attitude.shape)),
        dataclasses.replace(air, values=still[1]),
        dataclasses.replace(joints, positions=still[2]),
    )
    with np.errstate(divide="raise", invalid="raise"):
        verdict = judge(AIRCRAFT, FaultMonitorSettings(), dead)
    assert verdict.judged > 20.0
    assert not verdict.episodes
