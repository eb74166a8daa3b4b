"""The intake: what depends on the stamps alone, what is rejected, and that no message makes it raise."""

import copy
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from made_flights import JOINTS, made_aircraft, made_streams

from sysid_node.flight.align import BUFFER_NS, STEP_FORWARD_NS
from sysid_node.flight.checks import BEYOND, CLOCK_STEP, DUPLICATE, OUT_OF_ORDER, UNSTAMPED, gap
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.online.alignment.streaming import (
    BREAK_NS,
    AlignedSample,
    init,
    on_actuators,
    on_air_data,
    on_imu,
    stamp_of,
)
from sysid_node.online.types import SAMPLE_COLUMNS

AIRCRAFT = made_aircraft()
MS = 1_000_000
START = 1_700_000_000_000_000_000
FORCE_AND_RATES = (0.5, 0.1, -9.8, 0.1, -0.2, 0.05)


class Feed:
    """An intake, and what came out of it."""

    def __init__(self, max_gap: float = 0.2) -> None:
        self.state = init(AIRCRAFT, max_gap)
        self.samples: list[AlignedSample] = []

    def imu(self, stamp, values=FORCE_AND_RATES):
        self.samples += on_imu(self.state, stamp, values)

    def air(self, stamp, values=(18.0, 0.05, 0.01, 1.2)):
        self.samples += on_air_data(self.state, stamp, values)

    def joints(self, stamp, positions=(0.5, 0.1, 0.0, 0.0, 0.0, 0.0), names=JOINTS):
        self.samples += on_actuators(self.state, stamp, names, positions)

    def both(self, stamp):
        self.air(stamp)
        self.joints(stamp)

    def all(self, stamp):
        self.imu(stamp)
        self.both(stamp)

    @property
    def times(self):
        return [one.time for one in self.samples]

    def rejected(self, topic):
        return self.state.rejected[topic]


def messages_of(streams):
    """(topic, stamp, values) in log order."""
    rows = {IMU: streams.imu.values, AIR_DATA: streams.air_data.values, ACTUATORS: streams.actuators.positions}
    every = [
        (order, topic, stamp, tuple(row))
        for topic, stream in streams.by_topic.items()
        for order, stamp, row in zip(
            stream.arrival.order.tolist(), stream.arrival.stamp_ns.tolist(), rows[topic].tolist(), strict=True
        )
    ]
    return [message[1:] for message in sorted(every)]


def feed(messages, max_gap=0.2):
    out = Feed(max_gap)
    for topic, stamp, values in messages:
        if topic == IMU:
            out.imu(stamp, values)
        elif topic == AIR_DATA:
            out.air(stamp, values)
        else:
            out.joints(stamp, values)
    return out


# What comes out


def test_a_sample_waits_for_both_neighbours():
    f = Feed()
    f.both(START)
    f.imu(START + 5 * MS)
    assert not f.samples
    f.air(START + 10 * MS, (20.0, 0.07, 0.03, math.nan))
    assert not f.samples
    f.joints(START + 20 * MS, (0.9, 0.3, 0.0, 0.0, 0.0, 0.0))
    ((time, sample, wait),) = f.samples
    named = dict(zip((*SAMPLE_COLUMNS, "de", "da", "dr"), sample, strict=True))
    assert time == 0.0
    assert wait == 0.015
    assert sample[:6] == FORCE_AND_RATES
    assert named["V"] == pytest.approx(19.0)
    assert named["alpha"] == pytest.approx(0.06)
    assert named["rho"] == pytest.approx(0.5 * (1.2 + AIRCRAFT.reference.air_density))
    assert named["thrust"] == pytest.approx(30.0 * 0.6)
    assert named["de"] == pytest.approx(0.013 + 1.1 * 0.15)
    assert named["air_interval"] == 0.01


def test_samples_at_the_same_stamps_need_no_wait():
    f = Feed()
    for i in range(3):
        f.all(START + 10 * i * MS)
    assert f.times == [0.0, 0.01, 0.02]


def test_flow_angles_that_are_not_measured_stay_unknown():
    f = Feed()
    f.air(START, (18.0, math.nan, 0.01, 1.2))
    f.joints(START)
    f.imu(START)
    (_, sample, _) = f.samples[0]
    assert math.isnan(sample[7])
    assert sample[8] == 0.01


def test_time_counts_from_the_first_believed_imu_message():
    f = Feed()
    f.imu(START - 5 * MS, (math.nan,) * 6)
    f.both(START)
    for i in range(1, 4):
        f.imu(START + i * MS)
    f.both(START + 10 * MS)
    assert f.times == [0.0, 0.001, 0.002]
    assert [stamp_of(f.state, t) for t in f.times] == [START + i * MS for i in range(1, 4)]


# Stamps alone decide


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 3.0))
def test_the_order_of_arrival_between_topics_does_not_matter(seed, lateness):
    """Each topic late by its own, changing delay (up to 3 s), in order within itself: the same samples and counts."""
    messages = messages_of(made_streams(2.0, seed=seed % 7))
    rng = np.random.default_rng(seed)
    arrival = {}
    for topic in (IMU, AIR_DATA, ACTUATORS):
        stamps = np.array([stamp for t, stamp, _ in messages if t == topic])
        delay = rng.uniform(0, lateness * 1e9, stamps.size) * (rng.random(stamps.size) < 0.1)
        arrival[topic] = iter(np.maximum.accumulate(stamps + delay))
    late = sorted(((next(arrival[m[0]]), i, m) for i, m in enumerate(messages)), key=lambda x: x[:2])
    direct, delayed = feed(messages), feed([m for _, _, m in late])
    # the last samples may still be waiting in one of the two orders, in neither is one different
    assert direct.samples == delayed.samples
    assert direct.state.rejected == delayed.state.rejected


def test_topic_after_topic_gives_the_same_as_interleaved():
    messages = messages_of(made_streams(3.0))
    by_topic = sorted(messages, key=lambda m: (m[0] != ACTUATORS, m[0] != IMU))  # within the buffer of 5 s
    assert feed(by_topic).samples == feed(messages).samples


# What is rejected


def test_reasons_by_topic():
    f = Feed()
    f.both(START)
    f.imu(START + 1 * MS, (0.0, 0.0, -9.8, 90.0, 0.0, 0.0))
    f.imu(0)
    f.imu(-5)
    f.imu(2**31 * 10**9)
    f.imu(START + 2 * MS)
    f.imu(START + 2 * MS)
    f.imu(START + 1 * MS)
    f.air(START + 5 * MS, (18.0, 5.0, 0.0, 1.2))
    f.air(START, (18.0, 0.05, 0.0, 1.2))
    f.joints(START + 5 * MS, (0.5, 20.0, 0.0, 0.0, 0.0, 0.0))
    f.joints(START + 6 * MS, (0.1,), ("aileron",))
    stamps = {UNSTAMPED: 2, BEYOND: 1, DUPLICATE: 1, OUT_OF_ORDER: 1}
    assert f.rejected(IMU) == {"angular rate over 35 rad/s (deg/s?)": 1, **stamps}
    assert f.rejected(AIR_DATA) == {"angle_of_attack over pi/2 rad (degrees?)": 1, DUPLICATE: 1}
    assert f.rejected(ACTUATORS) == {
        "joint 'elevator' over pi/2 rad (degrees?)": 1,
        "joint 'elevator' missing or not finite": 1,
    }
    assert f.state.accepted == {IMU: 1, AIR_DATA: 1, ACTUATORS: 1}


def test_a_rejected_message_leaves_no_trace_in_time():
    """A message at fault must not make the next good one out of order."""
    f = Feed()
    f.both(START)
    f.air(START + 50 * MS, (math.nan, 0.0, 0.0, 1.2))
    f.imu(START + 1 * MS)
    f.both(START + 10 * MS)
    assert len(f.samples) == 1
    assert OUT_OF_ORDER not in f.rejected(AIR_DATA)


def test_nothing_is_interpolated_across_a_gap():
    f = Feed(max_gap=0.1)
    f.both(START)
    for i in range(1, 40):
        f.imu(START + 5 * i * MS)
        f.joints(START + 5 * i * MS)
    f.air(START + 150 * MS)
    f.air(START + 200 * MS)
    assert f.rejected(IMU) == {gap(AIR_DATA): 29}  # 5 to 145 ms; at 150 ms the message itself is there
    assert [round(t * 1e3) + 5 for t in f.times] == list(range(150, 200, 5))


def test_imu_before_the_first_air_data_has_no_neighbour():
    f = Feed()
    f.joints(START - 10 * MS)
    f.imu(START)
    f.imu(START + 20 * MS)
    f.air(START + 10 * MS)
    f.air(START + 30 * MS)
    f.joints(START + 30 * MS)
    assert f.rejected(IMU) == {gap(AIR_DATA): 1}
    assert f.times == [0.02]


def test_a_silent_topic_fills_no_memory_and_its_return_is_taken():
    f = Feed()
    f.both(START)
    for i in range(1, 3000):
        f.imu(START + 10 * i * MS)
        f.joints(START + 10 * i * MS)
    waited = BUFFER_NS // (10 * MS)
    assert len(f.state.imu.waiting) == waited + 1
    assert len(f.state.actuators.entries) <= 2 * waited + 2
    assert f.rejected(IMU) == {gap(AIR_DATA): 2999 - waited - 1}
    f.all(START + 30_000 * MS)
    f.all(START + 30_010 * MS)
    assert f.times[-1] == pytest.approx(30.0, abs=1e-9)


def test_air_data_without_imu_fill_no_memory():
    f = Feed()
    for i in range(5000):
        f.both(START + 10 * i * MS)
    assert len(f.state.air_data.entries) <= 2 * BUFFER_NS // (10 * MS) + 1


# Clocks that are set


@pytest.mark.parametrize("leap", [-600_000_000_000, -2_000_000_000, STEP_FORWARD_NS + 10**9, 10 * 365 * 86400 * 10**9])
@pytest.mark.parametrize("first", [IMU, AIR_DATA])
def test_a_clock_set_for_all_topics_breaks_the_time_and_mixes_nothing(leap, first):
    f = Feed()
    for i in range(100):
        f.air(START + 10 * i * MS, (18.0, 0.1, 0.0, 1.2))
        f.joints(START + 10 * i * MS)
        f.imu(START + (10 * i + 5) * MS)
    before = len(f.samples)
    for i in range(100, 200):
        calls = [
            lambda t: f.imu(t + 5 * MS),
            lambda t: (f.air(t, (18.0, -0.1, 0.0, 1.2)), f.joints(t)),
        ]
        for call in calls if first == IMU else calls[::-1]:
            call(START + leap + 10 * i * MS)
    times = np.array(f.times)
    assert np.all(np.diff(times) > 0)
    step = int(np.argmax(np.diff(times)))
    assert np.diff(times)[step] >= f.state.gap / 1e9 + BREAK_NS / 1e9
    alphas = [one.sample[7] for one in f.samples]
    assert set(alphas) == {0.1, -0.1}  # never a mixture
    assert before == 99
    assert len(f.samples) - before >= 97
    assert all(f.rejected(topic)[CLOCK_STEP] == 1 for topic in (IMU, AIR_DATA, ACTUATORS))
    assert stamp_of(f.state, f.times[-1]) == START + leap + 1985 * MS  # the last but one, with neighbours on both sides


def test_the_order_of_arrival_does_not_matter_when_a_clock_is_set():
    def messages(order):
        for i in range(300):
            stamp = START + 10 * i * MS - (100_000 * MS if i >= 150 else 0)
            yield from ((topic, stamp + order.index(topic) * 2 * MS) for topic in order)

    def run(order, delay):
        queue = [(i + (delay if topic == IMU else 0), i, topic, s) for i, (topic, s) in enumerate(messages(order))]
        f = Feed()
        for _, _, topic, stamp in sorted(queue):
            {IMU: f.imu, AIR_DATA: f.air, ACTUATORS: f.joints}[topic](stamp)
        return f

    order = (AIR_DATA, IMU, ACTUATORS)
    runs = [run(order, delay) for delay in (0, 5, 30, -7)]
    assert all(r.samples == runs[0].samples for r in runs[1:])
    assert all(r.state.rejected == runs[0].state.rejected for r in runs[1:])


@pytest.mark.parametrize("leap", [-600_000_000_000, STEP_FORWARD_NS + 10**9])
def test_one_stray_stamp_is_left_out_and_nothing_else(leap):
    f = Feed()
    for i in range(50):
        f.all(START + 10 * i * MS)
        if i == 20:
            f.imu(START + leap)
            f.air(START + leap)
    assert len(f.samples) == 50
    assert f.rejected(IMU) == {CLOCK_STEP: 1}
    assert f.rejected(AIR_DATA) == {CLOCK_STEP: 1}


@pytest.mark.parametrize("alone", ["imu", "both"])
def test_a_clock_set_for_one_topic_alone_heals_when_it_agrees_again(alone):
    """The topic's stamps are wrong for a while: nothing is combined with them, and all is well afterwards."""
    f = Feed()
    for i in range(3000):
        stamp = START + 10 * i * MS
        wrong = stamp - 1_000_000 * MS if 500 <= i < 1500 else stamp
        f.imu(wrong if alone == "imu" else stamp)
        f.both(wrong if alone == "both" else stamp)
    count = len(f.samples)
    assert 1000 < count < 2100
    f.all(START + 30_000 * MS)
    assert len(f.samples) > count
    assert np.all(np.diff(f.times) > 0)


# Anything at all

numbers = st.one_of(
    st.floats(), st.integers(-(10**320), 10**320), st.sampled_from([0.0, 0.1, -9.8, 18.0, math.nan, math.inf, 1e308])
)
stamps = st.one_of(
    st.integers(0, 60).map(lambda k: START + 10 * k * MS),
    st.sampled_from([0, -1, 1, 2**31 * 10**9, 2**63, -(2**63), START + 10**12, START - 10**12, 10**30]),
)
names = st.lists(st.sampled_from([*JOINTS, "x"]), max_size=8)
anything = st.one_of(
    st.tuples(st.just(IMU), stamps, st.tuples(*[numbers] * 6)),
    st.tuples(st.just(AIR_DATA), stamps, st.tuples(*[numbers] * 4)),
    st.tuples(st.just(ACTUATORS), stamps, st.tuples(names, st.lists(numbers, max_size=8))),
    st.tuples(st.just(IMU), stamps, st.just(FORCE_AND_RATES)),
    st.tuples(st.just(AIR_DATA), stamps, st.just((18.0, 0.05, 0.01, 1.2))),
    st.tuples(st.just(ACTUATORS), stamps, st.just((list(JOINTS), [0.5, 0.1, 0.0, 0.0, 0.0, 0.0]))),
)


@settings(max_examples=300, deadline=None)
@given(st.lists(anything, max_size=60))
@example([(IMU, 10**400, FORCE_AND_RATES), (IMU, START, FORCE_AND_RATES), (IMU, START + MS, FORCE_AND_RATES)])
def test_no_message_makes_it_raise_or_lets_nonsense_through(messages):
    f = Feed()
    for topic, stamp, values in messages:
        if topic == ACTUATORS:
            f.joints(stamp, values[1], values[0])
        else:
            (f.imu if topic == IMU else f.air)(stamp, values)
    counted = sum(f.state.accepted.values()) + sum(
        count
        for topic, reasons in f.state.rejected.items()
        for reason, count in reasons.items()
        if topic != IMU or not reason.endswith(" gap")  # of IMU messages that had been accepted
    )
    assert counted == len(messages)
    assert all(a < b for a, b in zip(f.times, f.times[1:], strict=False))
    for _, sample, _ in f.samples:
        assert len(sample) == len(SAMPLE_COLUMNS) + 3
        unknown = {i for i, x in enumerate(sample) if not math.isfinite(x)}
        assert unknown <= {7, 8, 10}  # flow angles and thrust may be unknown, nothing else
        assert all(abs(x) <= 1e4 for x in sample if math.isfinite(x))


def test_the_state_can_be_copied():
    """Nothing in it is shared with the outside, not even the names of a message."""
    f = Feed()
    names = list(JOINTS)
    f.joints(START, names=names)
    names[1] = "other"
    f.joints(START + MS, names=names)
    assert f.rejected(ACTUATORS) == {"joint 'elevator' missing or not finite": 1}
    copy.deepcopy(f.state)
