"""Alignment in pieces gives the bits of the message-by-message alignment, whatever the recording and the pieces."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_flights import made_aircraft, made_streams

from sysid_node.aircraft.model import UncertainValue
from sysid_node.flight.streams import Arrival, Streams
from sysid_node.online.alignment.in_pieces import PieceAlignment

AIRCRAFT = made_aircraft()
#: Its file states errors of the instruments, and stamps that are late.
STATING = dataclasses.replace(
    AIRCRAFT,
    delays={topic: UncertainValue(x) for topic, x in (("imu", 0.02), ("air_data", -0.013), ("actuators", 0.25))},
    effects={
        "imu_bias": {"q": UncertainValue(0.01)},
        "imu_scale": {"az": UncertainValue(0.1)},
        "imu_misalignment": {"roll": UncertainValue(0.1), "yaw": UncertainValue(-0.05)},
        "airspeed_scale": {"error": UncertainValue(0.07)},
        "vane_bias": {"alpha": UncertainValue(0.02)},
    },
)


def cut(streams: Streams, shares) -> list[Streams]:
    """The messages as recorded, cut where these shares of them have come."""
    every = np.sort(np.concatenate([stream.arrival.order for stream in streams.by_topic.values()]))
    borders = [every[0], *(every[int(share * (every.size - 1))] for share in sorted(shares)), every[-1] + 1]
    return [_between(streams, begin, end) for begin, end in pairwise(borders)]


def _between(streams: Streams, begin: int, end: int) -> Streams:
    parts = {}
    for name, field in (("imu", "values"), ("air_data", "values"), ("actuators", "positions")):
        stream = getattr(streams, name)
        arrival = stream.arrival
        keep = (arrival.order >= begin) & (arrival.order < end)
        come = Arrival(arrival.stamp_ns[keep], arrival.log_ns[keep], arrival.order[keep])
        parts[name] = dataclasses.replace(stream, arrival=come, **{field: getattr(stream, field)[keep]})
    return Streams(**parts, piece=True)


def together(pieces, alignment):
    """What the pieces give, one behind the other."""
    found = [alignment.take(piece, last=piece is pieces[-1]) for piece in pieces]
    width = max(part.samples.shape[1] for part in found)
    begins, before = [], 0
    for part in found:
        begins += [before + part.commands_from] if part.commands_from < part.time.size else []
        before += part.time.size
    return (
        np.concatenate([part.time for part in found]).tobytes(),
        b"".join(np.pad(p.samples, ((0, 0), (0, width - p.samples.shape[1]))).tobytes() for p in found),
        np.concatenate([part.stamps for part in found]).tobytes(),
        np.concatenate([part.wait for part in found]).tobytes(),
        {topic: dict(reasons) for topic, reasons in alignment.rejected.items()},
        begins[:1],
    )


def assert_same_bits(streams, max_gap=0.2, carried="positions", shares=(0.1, 0.35, 0.36, 0.8), aircraft=AIRCRAFT):
    wanted = together([streams], PieceAlignment(aircraft, max_gap, carried, by_message=True))
    assert together([streams], PieceAlignment(aircraft, max_gap, carried)) == wanted
    assert together(cut(streams, shares), PieceAlignment(aircraft, max_gap, carried)) == wanted
    return PieceAlignment(aircraft, max_gap, carried).take(streams, last=True)


def is_regular(streams, max_gap=0.2):
    whole = PieceAlignment(AIRCRAFT, max_gap)
    whole.take(streams, last=True)
    return whole.regular


def changed(streams: Streams, topic: str, change) -> Streams:
    """The streams with one topic's arrival and values changed by ``change(arrival, values)`` in place."""
    field = {"imu": "values", "air_data": "values", "actuators": "positions"}[topic]
    stream = getattr(streams, topic)
    old = stream.arrival
    arrival = Arrival(old.stamp_ns.copy(), old.log_ns.copy(), old.order.copy())
    values = getattr(stream, field).copy()
    change(arrival, values)
    return dataclasses.replace(streams, **{topic: dataclasses.replace(stream, arrival=arrival, **{field: values})})


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("max_gap", [0.001, 0.03, 0.2, 6.0])
def test_clean_recordings(seed, max_gap):
    streams = made_streams(3.0, seed)
    assert is_regular(streams, max_gap)
    bulk = assert_same_bits(streams, max_gap)
    assert (bulk.time.size > 100) == (max_gap > 0.001)  # nothing is that close together
    assert np.all(np.diff(bulk.stamps) > 0)


def with_steps(streams: Streams, every: int) -> Streams:
    """The streams with joints that stay where they are and jump with every so many messages."""

    def change(arrival, values):
        values[:, 1:] = 0.1 * ((np.arange(len(values)) // every) % 2)[:, None]

    return changed(streams, "actuators", change)


@pytest.mark.parametrize("carried", ["commands", "auto"])
@pytest.mark.parametrize("every", [7, 1000])
@pytest.mark.parametrize("aircraft", [AIRCRAFT, STATING])
def test_commands(carried, every, aircraft):
    """Servos follow the commands in the same bits; where nothing jumps, ``auto`` interpolates positions."""
    bulk = assert_same_bits(with_steps(made_streams(3.0, 1), every), 0.2, carried, aircraft=aircraft)
    assert (bulk.commands_from == 0) == (carried == "commands")
    assert (bulk.commands_from < bulk.time.size) == (carried == "commands" or every == 7)


def test_faulty_values_are_left_out_in_bulk_too():
    def spoil(arrival, values):
        rng = np.random.default_rng(5)
        rows = rng.choice(len(values), 25, replace=False)
        values[rows, rng.integers(0, values.shape[1], 25)] = rng.choice([np.nan, np.inf, 57.0, 1e9], 25)
        arrival.stamp_ns[rows[:3] + 1] = arrival.stamp_ns[rows[:3]]
        arrival.stamp_ns[rows[3]] = 0

    streams = made_streams(3.0)
    for topic in ("imu", "air_data", "actuators"):
        streams = changed(streams, topic, spoil)
    assert is_regular(streams)
    bulk = assert_same_bits(streams)
    assert sum(sum(reasons.values()) for reasons in bulk.rejected.values()) > 50


@pytest.mark.parametrize("topic", ["imu", "air_data", "actuators"])
@pytest.mark.parametrize("leap", [-20_000_000_000, -1_500_000_000, 400_000_000_000])
def test_clocks_that_were_set(topic, leap):
    def step(arrival, _):
        arrival.stamp_ns[len(arrival) // 2 :] += leap

    streams = changed(made_streams(4.0), topic, step)
    assert not is_regular(streams)
    assert_same_bits(streams)


def test_all_clocks_set_at_once():
    streams = made_streams(6.0, start_s=2000.0)
    for topic in ("imu", "air_data", "actuators"):

        def step(arrival, _):
            arrival.stamp_ns[arrival.stamp_ns > 2_003_000_000_000] -= 1_000_000_000_000

        streams = changed(streams, topic, step)
    assert not is_regular(streams)
    bulk = assert_same_bits(streams)
    assert bulk.time.size > 1000
    assert np.max(np.diff(bulk.time)) > 1.2
    assert bulk.stamps[-1] < bulk.stamps[0]


@pytest.mark.parametrize("topic", ["imu", "air_data", "actuators"])
def test_a_topic_that_was_recorded_late(topic):
    """Behind the others by more than the buffer: samples are lost, the same ones live and in the replay."""

    def delay(arrival, _):
        arrival.order[:] += 10**6  # after everything else

    streams = changed(made_streams(12.0), topic, delay)
    assert not is_regular(streams)
    assert_same_bits(streams)


@pytest.mark.parametrize("topic", ["imu", "air_data", "actuators"])
@pytest.mark.parametrize("silence", [(4.0, 4.5), (3.0, 10.0), (5.0, 12.0), (0.0, 6.0)])
def test_a_topic_that_fell_silent(topic, silence):
    streams = made_streams(12.0)
    stream = getattr(streams, topic)
    t = (stream.arrival.stamp_ns - streams.imu.arrival.stamp_ns[0]) / 1e9
    keep = ~((t >= silence[0]) & (t < silence[1]))
    arrival = Arrival(stream.arrival.stamp_ns[keep], stream.arrival.log_ns[keep], stream.arrival.order[keep])
    field = "positions" if topic == "actuators" else "values"
    short = dataclasses.replace(stream, arrival=arrival, **{field: getattr(stream, field)[keep]})
    assert_same_bits(dataclasses.replace(streams, **{topic: short}))


SHIFTS = (0, -1, -2_000_000_000, 10**7, -(10**7), 3 * 10**11, 6_000_000_000, None)
faults = st.lists(st.tuples(st.integers(0, 1000), st.sampled_from(SHIFTS), st.booleans()), max_size=5)


@settings(max_examples=100, deadline=None)
@given(
    st.integers(0, 3),
    st.tuples(faults, faults, faults),
    st.booleans(),
    st.integers(0, 9),
    st.sampled_from(["positions", "commands", "auto"]),
    st.lists(st.floats(0.0, 1.0), max_size=4),
    st.sampled_from([AIRCRAFT, STATING]),
)
def test_recordings_of_any_kind(seed, wrong, shuffled, order_seed, carried, shares, aircraft):
    """Repeated, absent, leaping and disordered stamps; topics that arrive in any order."""
    streams = made_streams(0.5, seed=seed)
    lengths = [len(stream.arrival) for stream in streams.by_topic.values()]
    rng = np.random.default_rng(order_seed)
    places = np.split(rng.permutation(sum(lengths)), np.cumsum(lengths)[:-1])

    for topic, some, place in zip(("imu", "air_data", "actuators"), wrong, places, strict=True):

        def spoil(arrival, _, some=some, place=place):
            for where, shift, onwards in some:
                first = where % len(arrival)
                rows = slice(first, None if onwards else first + 1)
                arrival.stamp_ns[rows] = 0 if shift is None else arrival.stamp_ns[rows] + shift
            if shuffled:
                arrival.order[:] = np.sort(place)
                rng.shuffle(arrival.stamp_ns[3:9])

        streams = changed(streams, topic, spoil)
    streams = with_steps(streams, 4) if carried == "auto" else streams
    assert_same_bits(streams, carried=carried, shares=shares, aircraft=aircraft)
