"""A session: messages in, estimates out, in the time of the data."""

import math
from dataclasses import replace

import numpy as np
import pytest
from due_times import due_times
from harness import ROOT, START_NS, made_up_streams

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.streams import Arrival, Streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.session import Due, Session
from sysid_node.online.settings import OnlineSettings


def fly(session: Session, flight: Streams, order: str) -> list[Due]:
    """Feed a flight, topics at equal stamps in the given order; what falls due."""
    names = flight.actuators.names
    take = {
        "i": (flight.imu, flight.imu.values, session.imu),
        "a": (flight.air_data, flight.air_data.values, session.air_data),
        "j": (flight.actuators, flight.actuators.positions, lambda stamp, row: session.actuators(stamp, names, row)),
    }
    messages = sorted(
        (stamp, order.index(letter), letter, row)
        for letter, (stream, values, _) in take.items()
        for stamp, row in zip(stream.arrival.stamp_ns.tolist(), values.tolist(), strict=True)
    )
    return [due for stamp, _, letter, row in messages for due in take[letter][2](stamp, tuple(row))]


def without_a_part_of_each_second(flight: Streams, hole: float) -> Streams:
    """The flight whose IMU was silent for the first ``hole`` s of each second."""
    imu = flight.imu
    kept = (imu.arrival.stamp_ns - START_NS) % 10**9 >= hole * 1e9
    arrival = Arrival(imu.arrival.stamp_ns[kept], imu.arrival.log_ns[kept], imu.arrival.order[kept])
    return replace(flight, imu=replace(imu, arrival=arrival, values=imu.values[kept], attitude=imu.attitude[kept]))


@pytest.fixture
def session() -> Session:
    return Session(load_aircraft("cdrw"), OnlineSettings(), 10.0)


def test_estimates_fall_due_in_the_time_of_the_data(session: Session) -> None:
    due = fly(session, made_up_streams(3.0), "iaj")
    assert [one.stamp_ns - START_NS for one in due] == [k * 100_000_000 for k in range(1, 30)]
    assert session.samples == 599


def test_the_order_of_arrival_does_not_matter() -> None:
    one, other = (
        fly(Session(load_aircraft("cdrw"), OnlineSettings(), 10.0), made_up_streams(5.0), order)
        for order in ("iaj", "jai")
    )
    assert repr(one) == repr(other)


def test_flow_angles_that_fail_in_flight_make_estimates_stale_live_and_at_the_desk() -> None:
    """For a second no angle of attack is measured; samples go on, and what is known grows old meanwhile."""
    aircraft, flight = load_aircraft("cdrw"), made_up_streams(8.0)
    flight.air_data.values[500:600, 1] = math.nan
    live = fly(Session(aircraft, OnlineSettings(), 10.0), flight, "iaj")
    aligned = align_streams(aircraft, flight, OnlineSettings().max_gap)
    desk = run(aircraft, OnlineSettings(), aligned.time, aligned.samples, due_times(aligned.time, aligned.wait, 10.0))
    assert repr([one.estimates for one in live]) == repr(desk)
    stale = [
        i for i, one in enumerate(live) if {d.status for d in one.estimates.derivatives.values()} == {"stale input"}
    ]
    assert stale == [54, 55, 56, 57, 58]


def test_reset_forgets(session: Session) -> None:
    first = fly(session, made_up_streams(3.0), "iaj")
    session.reset()
    assert (session.samples, session.rejected) == (0, {})
    assert repr(fly(session, made_up_streams(3.0), "iaj")) == repr(first)


def test_the_covariance_is_new_once_with_every_renewal(session: Session) -> None:
    assert session.renewed_covariance() is None, "nothing is known yet"
    fly(session, made_up_streams(5.0), "iaj")
    covariance = session.renewed_covariance()
    assert covariance is not None
    _, matrix = covariance.correlation()
    np.testing.assert_allclose(matrix.diagonal(), 1.0)
    assert session.renewed_covariance() is None
    session.reset()
    assert session.renewed_covariance() is None


def test_silence_is_stale(session: Session) -> None:
    fly(session, made_up_streams(5.0), "iaj")
    assert {d.status for d in session.now(10.0).estimates.derivatives.values()} == {"stale input"}
    assert {d.status for d in session.now().estimates.derivatives.values()} != {"stale input"}


def test_what_actuators_are_taken_for_follows_the_messages() -> None:
    """Joints that jump are commands; a reset forgets it."""
    session, flight = Session(load_aircraft("cdrw"), OnlineSettings(), 10.0), made_up_streams(2.0)
    jumps = 0.1 * ((np.arange(200) // 20) % 2)
    flight.actuators.positions[100:, :3] = jumps[100:, np.newaxis]
    assert not session.commanded
    assert session.carried().startswith("Actuators are taken as positions")
    fly(session, flight, "iaj")
    assert session.commanded
    assert session.carried().startswith("Actuators carry commands (inferred from the messages)")
    session.reset()
    assert not session.commanded
    stated = Session(load_aircraft("cdrw"), OnlineSettings(actuators="positions"), 10.0)
    assert (stated.commanded, stated.carried()) == (False, "")


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "said"), [(1.0, False), (3.6, True)])
def test_airspeed_in_another_unit_is_said_in_flight(session: Session, scale: float, said: bool) -> None:
    """All derivatives are wrong then, and valid: they fit the flight as well as the right ones do."""
    flight = read_streams(ROOT / "bags" / "cdrw_multistep")
    flight.air_data.values[:, 0] *= scale
    fly(session, flight, "iaj")
    assert ("is the airspeed in m/s" in session.lift_fault) == said


@pytest.mark.parametrize(("scale", "said"), [(1.0, False), (1.0 / 0.35, True)])
def test_surfaces_as_shares_of_their_travel_are_said_in_flight(scale: float, said: bool) -> None:
    """Steps to 0.2 rad of 0.35, taken as commands. Derivatives by shares would be valid, and wrong."""
    session, flight = Session(load_aircraft("cdrw"), OnlineSettings(), 10.0), made_up_streams(6.0)
    flight.actuators.positions[:, 0] = scale * 0.2 * ((np.arange(600) // 50) % 2)
    fly(session, flight, "iaj")
    assert session.commanded
    assert session.deflections.fault.startswith("elevator is deflected by up to 0.57 rad") == said


@pytest.mark.parametrize(("hole", "said"), [(0.25, True), (0.15, False)])
def test_an_imu_that_is_interrupted_every_second_is_said_in_flight(session: Session, hole: float, said: bool) -> None:
    """Nothing is ever estimated from parts that short; a hole shorter than ``max_gap`` is bridged."""
    flight = made_up_streams(12.0)
    fly(session, without_a_part_of_each_second(flight, hole), "iaj")
    assert ("interruptions of up to 0.2" in session.interruptions) == said
    session.reset()
    assert session.interruptions == ""


def flown_with_rates(sign: float) -> Session:
    """A session after 30 s of a bundled flight whose yaw and pitch rates are multiplied by a sign."""
    flight = read_streams(ROOT / "bags" / "cdrw_multistep")
    session = Session(load_aircraft("cdrw"), OnlineSettings(), 10.0)
    names, imu = flight.actuators.names, flight.imu
    events = [(at, 0, i) for i, at in enumerate(imu.arrival.stamp_ns.tolist())]
    events += [(at, 1, i) for i, at in enumerate(flight.air_data.arrival.stamp_ns.tolist())]
    events += [(at, 2, i) for i, at in enumerate(flight.actuators.arrival.stamp_ns.tolist())]
    begin = min(events)[0]
    for at, topic, i in sorted(event for event in events if event[0] - begin < 30 * 10**9):
        if topic == 0:
            *force, p, q, r = imu.values[i].tolist()
            phi, theta, _ = imu.attitude[i].tolist()
            session.imu(at, (*force, p, sign * q, sign * r), (phi, theta))
        elif topic == 1:
            session.air_data(at, tuple(flight.air_data.values[i].tolist()))
        else:
            session.actuators(at, names, flight.actuators.positions[i].tolist())
    return session


@pytest.mark.slow
def test_no_estimate_is_valid_where_rates_are_in_other_axes() -> None:
    """Forward, left, up taken for forward, right, down turns the signs of q and r."""
    session = flown_with_rates(-1.0)
    assert session.sign_fault.startswith("q, r or ay: the sign is wrong")
    assert {one.status for one in session.now().estimates.derivatives.values()} == {"outside model"}


@pytest.mark.slow
def test_a_sound_flight_has_valid_estimates_and_no_sign_fault() -> None:
    session = flown_with_rates(1.0)
    assert (session.sign_fault, session.attitude_fault) == ("", "")
    assert any(one.valid for one in session.now().estimates.derivatives.values())
