"""Bulk alignment gives the bits of the message-by-message intake, whatever the recording."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_flights import made_aircraft, made_streams

from sysid_node.flight.align import align
from sysid_node.flight.streams import Arrival, Streams
from sysid_node.online.alignment import whole_record
from sysid_node.online.alignment.whole_record import align_streams

AIRCRAFT = made_aircraft()


def assert_same_bits(streams, max_gap=0.2, carried="positions"):
    bulk = align_streams(AIRCRAFT, streams, max_gap, carried)
    single = whole_record.align_by_message(AIRCRAFT, streams, max_gap, carried)
    assert bulk.commands_from == single.commands_from
    assert bulk.time.tobytes() == single.time.tobytes()
    assert bulk.samples.tobytes() == single.samples.reshape(bulk.samples.shape).tobytes()
    assert bulk.stamps.tobytes() == single.stamps.tobytes()
    assert bulk.wait.tobytes() == single.wait.tobytes()
    assert bulk.rejected == single.rejected
    return bulk


def is_regular(streams, max_gap=0.2):
    return whole_record.is_regular(align(AIRCRAFT, streams, max_gap), streams, max_gap)


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
def test_commands(carried, every):
    """Servos follow the commands in the same bits; where nothing jumps, ``auto`` interpolates positions."""
    bulk = assert_same_bits(with_steps(made_streams(3.0, 1), every), 0.2, carried)
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
    cut = dataclasses.replace(stream, arrival=arrival, **{field: getattr(stream, field)[keep]})
    assert_same_bits(dataclasses.replace(streams, **{topic: cut}))


SHIFTS = (0, -1, -2_000_000_000, 10**7, -(10**7), 3 * 10**11, 6_000_000_000, None)
faults = st.lists(st.tuples(st.integers(0, 1000), st.sampled_from(SHIFTS), st.booleans()), max_size=5)


@settings(max_examples=100, deadline=None)
@given(
    st.integers(0, 3),
    st.tuples(faults, faults, faults),
    st.booleans(),
    st.integers(0, 9),
    st.sampled_from(["positions", "commands", "auto"]),
)
def test_recordings_of_any_kind(seed, wrong, shuffled, order_seed, carried):
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
    assert_same_bits(with_steps(streams, 4) if carried == "auto" else streams, carried=carried)
