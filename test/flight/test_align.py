"""Alignment against NumPy's own interpolation, and what is left out."""

import dataclasses

import numpy as np
import pytest
from made_flights import made_aircraft, made_streams

from sysid_node.aircraft.model import UncertainValue
from sysid_node.errors import InputError
from sysid_node.flight import align as alignment
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import AIR_INTERVAL, align, counts_by_reason, flight_record, why_nothing_aligned
from sysid_node.flight.checks import BEYOND, DUPLICATE, OUT_OF_ORDER, UNSTAMPED, gap
from sysid_node.flight.streams import Arrival
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU
from sysid_node.online.types import SAMPLE_COLUMNS

AIRCRAFT = made_aircraft()


def with_stamps(stream, stamps):
    """The stream with other header stamps, logged as before."""
    arrival = Arrival(np.asarray(stamps, np.int64), stream.arrival.log_ns, stream.arrival.order)
    return dataclasses.replace(stream, arrival=arrival)


def keep(stream, rows, names=("values",)):
    """Some messages of a stream."""
    arrival = Arrival(stream.arrival.stamp_ns[rows], stream.arrival.log_ns[rows], stream.arrival.order[rows])
    return dataclasses.replace(stream, arrival=arrival, **{name: getattr(stream, name)[rows] for name in names})


def test_columns_are_the_estimators():
    assert alignment.sample_columns(AIRCRAFT) == (*SAMPLE_COLUMNS, "de", "da", "dr")


def test_interpolates_linearly_in_stamp_time():
    streams = made_streams(3.0)
    aligned = align(AIRCRAFT, streams, max_gap=1.0)
    at, air, joints = aligned.stamps, streams.air_data, streams.actuators
    start = at[0]
    controls, _ = Actuation.of(AIRCRAFT).of_array(joints.names, joints.positions)
    rho = np.where(np.isnan(air.values[:, 3]), AIRCRAFT.reference.air_density, air.values[:, 3])
    for column, values, stream in (
        *((6 + i, air.values[:, i], air) for i in range(3)),
        (9, rho, air),
        (10, controls[:, 0], joints),
        *((12 + i, controls[:, 1 + i], joints) for i in range(3)),
    ):
        expected = np.interp(at - start, stream.arrival.stamp_ns - start, values)
        np.testing.assert_allclose(aligned.samples[:, column], expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(aligned.samples[:, :6], streams.imu.values[aligned.imu.kept[aligned.used]])


def test_records_keep_stated_delays_and_errors_for_the_diagnosis_that_models_them():
    """The estimators take them out (``batch.systematic.stated_errors``); twice would be once too often."""
    delays = {topic: UncertainValue(delay) for topic, delay in (("imu", 0.03), ("air_data", 0.01), ("actuators", 0.1))}
    effects = {"airspeed_scale": {"error": UncertainValue(0.1)}, "imu_bias": {"q": UncertainValue(0.1)}}
    stating = dataclasses.replace(AIRCRAFT, delays=delays, effects=effects)
    streams = made_streams(2.0)
    for carried in ("positions", "commands"):
        plain, other = (flight_record(aircraft, streams, 0.2, carried) for aircraft in (AIRCRAFT, stating))
        for name, column in plain.columns.items():
            np.testing.assert_array_equal(other[name], column, err_msg=name)


def test_a_straight_line_comes_out_straight():
    # truth: linear signals are reproduced exactly by interpolation; a hold would be late by half a period
    streams = made_streams(2.0)
    t = streams.air_data.arrival.stamp_ns / 1e9
    ramp = np.column_stack([10.0 + 0.1 * t, 1e-3 * t, -1e-3 * t, np.full(t.size, 1.2)])
    streams = dataclasses.replace(streams, air_data=dataclasses.replace(streams.air_data, values=ramp))
    aligned = align(AIRCRAFT, streams, 1.0)
    np.testing.assert_allclose(aligned.samples[:, 6], 10.0 + 0.1 * aligned.stamps / 1e9, rtol=1e-12)


def test_a_stamp_met_exactly_takes_that_message_alone():
    streams = made_streams(1.0)
    values = streams.air_data.values.copy()
    values[11, 1] = np.nan  # the right neighbour must not matter
    stamps = streams.imu.arrival.stamp_ns.copy()
    near = np.searchsorted(stamps, streams.air_data.arrival.stamp_ns[10])
    stamps[near] = streams.air_data.arrival.stamp_ns[10]
    streams = dataclasses.replace(
        streams,
        imu=with_stamps(streams.imu, stamps),
        air_data=dataclasses.replace(streams.air_data, values=values),
    )
    aligned = align(AIRCRAFT, streams, 1.0)
    row = np.flatnonzero(aligned.stamps == stamps[near])[0]
    assert aligned.samples[row, 7] == values[10, 1]
    assert np.isnan(aligned.samples[row + 1, 7])


def test_air_interval_is_the_spacing_of_the_neighbours():
    streams = made_streams(1.0)
    aligned = align(AIRCRAFT, streams, 1.0)
    stamps = streams.air_data.arrival.stamp_ns
    right = np.searchsorted(stamps, aligned.stamps)
    expected = (stamps[right] - stamps[right - 1]) / 1e9
    np.testing.assert_array_equal(aligned.samples[:, SAMPLE_COLUMNS.index(AIR_INTERVAL)], expected)


def test_no_interpolation_across_a_gap():
    streams = made_streams(4.0)
    t = (streams.air_data.arrival.stamp_ns - streams.air_data.arrival.stamp_ns[0]) / 1e9
    air = keep(streams.air_data, (t < 1.0) | (t > 1.5))
    aligned = align(AIRCRAFT, dataclasses.replace(streams, air_data=air), 0.2)
    left = air.arrival.stamp_ns[np.flatnonzero(t < 1.0)[-1]]
    right = air.arrival.stamp_ns[np.flatnonzero(t < 1.0)[-1] + 1]
    inside = (streams.imu.arrival.stamp_ns > left) & (streams.imu.arrival.stamp_ns < right)
    early = streams.imu.arrival.stamp_ns < streams.air_data.arrival.stamp_ns[0]
    assert aligned.rejected[IMU][gap(AIR_DATA)] == np.count_nonzero(inside | early)
    assert not np.isin(aligned.stamps, streams.imu.arrival.stamp_ns[inside]).any()


def test_faulty_stamps_are_counted_by_reason():
    streams = made_streams(2.0)
    stamps = streams.imu.arrival.stamp_ns.copy()
    stamps[50], stamps[60], stamps[70], stamps[80] = stamps[49], 0, stamps[70] - 20_000_000, 2**31 * 10**9
    aligned = align(AIRCRAFT, dataclasses.replace(streams, imu=with_stamps(streams.imu, stamps)), 1.0)
    counts = aligned.rejected[IMU]
    assert (counts[DUPLICATE], counts[UNSTAMPED], counts[OUT_OF_ORDER], counts[BEYOND]) == (1, 1, 1, 1)
    assert np.all(np.diff(aligned.stamps) > 0)


def test_record_has_named_columns_attitude_and_counts():
    streams = made_streams(2.0)
    values = streams.air_data.values.copy()
    values[5, 1] = 20.0
    streams = dataclasses.replace(streams, air_data=dataclasses.replace(streams.air_data, values=values))
    record = flight_record(AIRCRAFT, streams, 0.5)
    aligned = align(AIRCRAFT, streams, 0.5)
    assert set(record.columns) == {*SAMPLE_COLUMNS, "de", "da", "dr", "phi", "theta", "psi"} - {AIR_INTERVAL}
    np.testing.assert_array_equal(record["da"], aligned.samples[:, 13])
    np.testing.assert_array_equal(record["theta"], streams.imu.attitude[aligned.imu.kept[aligned.used], 1])
    assert record.rejected == counts_by_reason(aligned.rejected)
    assert record.rejected["air_data: angle_of_attack over pi/2 rad (degrees?)"] == 1
    assert record.start_ns + round(record.time[0] * 1e9) == aligned.stamps[0]


def test_record_keeps_the_interval_of_a_slow_logs_commands():
    streams = made_streams(2.0)
    slow = dataclasses.replace(streams, actuators=dataclasses.replace(streams.actuators, interval=0.1))
    assert flight_record(AIRCRAFT, streams, 0.5).command_interval == 0.0
    assert flight_record(AIRCRAFT, slow, 0.5).command_interval == 0.1


def test_topics_that_do_not_overlap_are_said_so():
    streams = made_streams(1.0)
    later = with_stamps(streams.air_data, streams.air_data.arrival.stamp_ns + 50_000_000_000)
    with pytest.raises(InputError, match=r"do not overlap: imu/data 100\.\d+ to 10\d\.\d+ s, air_data 149\.99"):
        flight_record(AIRCRAFT, dataclasses.replace(streams, air_data=later), 0.2)


def test_a_single_message_is_not_called_an_overlap_that_is_missing():
    streams = made_streams(1.0)
    alone = with_stamps(streams.air_data, np.full_like(streams.air_data.arrival.stamp_ns, 100_000_000_000))
    with pytest.raises(InputError, match="all of air_data is of a single time; at least two messages") as caught:
        flight_record(AIRCRAFT, dataclasses.replace(streams, air_data=alone), 0.2)
    assert "overlap" not in str(caught.value)


def test_the_commonest_reasons_are_said_where_nothing_is_left():
    streams = made_streams(1.0)
    degrees = dataclasses.replace(streams.actuators, positions=np.full_like(streams.actuators.positions, 5.0))
    with pytest.raises(InputError, match=r"actuators: joint 'elevator' over pi/2 rad \(degrees\?\)"):
        flight_record(AIRCRAFT, dataclasses.replace(streams, actuators=degrees), 0.2)


def test_a_clock_set_back_is_said_with_topic_and_time():
    streams = made_streams(4.0)
    stamps = streams.imu.arrival.stamp_ns.copy()
    stamps[350:] -= 10_000_000_000
    with pytest.raises(InputError, match=r"stamps of imu/data go back 1.[78] s into"):
        flight_record(AIRCRAFT, dataclasses.replace(streams, imu=with_stamps(streams.imu, stamps)), 0.2)


def test_the_end_of_the_recording_is_not_a_rejection():
    streams = made_streams(2.0)
    stamps = streams.actuators.arrival.stamp_ns
    cut = keep(streams.actuators, stamps < stamps[-1] - 300_000_000, ("positions",))
    aligned = align(AIRCRAFT, dataclasses.replace(streams, actuators=cut), 1.0)
    assert gap(ACTUATORS) not in aligned.rejected[IMU] or aligned.rejected[IMU][gap(ACTUATORS)] <= 4  # before the first
    assert aligned.stamps[-1] <= cut.arrival.stamp_ns[-1]


@pytest.mark.parametrize(
    ("rejected", "remedy"),
    [
        (
            {"imu/data": {"air_data gap": 90}, "air_data": {"out of order": 9}},
            "air_data must come at least every 0.2 s (5 Hz), or max_gap be longer",
        ),
        ({"imu/data": {"actuators gap": 90}}, "actuators must come at least every 0.2 s (5 Hz), or max_gap be longer"),
        (
            {"imu/data": {"actuators gap": 90}, "actuators": {"no stamp": 91}},
            "correct the messages or the aircraft file",
        ),
    ],
)
def test_what_to_do_where_nothing_is_aligned(rejected: dict[str, dict[str, int]], remedy: str) -> None:
    spans = dict.fromkeys(("imu/data", "air_data", "actuators"), (0.0, 9.0))
    said = why_nothing_aligned("flight", spans, rejected)
    assert remedy in said
    assert "\n" not in said


def test_what_is_said_where_nothing_is_aligned_is_of_the_gap_that_was_asked_for() -> None:
    spans = dict.fromkeys(("imu/data", "air_data", "actuators"), (0.0, 9.0))
    said = why_nothing_aligned("flight", spans, {"imu/data": {"air_data gap": 90}}, max_gap=0.5)
    assert "air_data must come at least every 0.5 s (2 Hz)" in said
