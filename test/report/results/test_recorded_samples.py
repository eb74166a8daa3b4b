"""A short flight is kept whole; of a long one a bounded number of samples, with every peak."""

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.online.types import SAMPLE_COLUMNS
from sysid_node.report.results.recorded_samples import MOST, RecordedSamples

AIRCRAFT = load_aircraft("cdrw")
WIDTH = len(SAMPLE_COLUMNS) + len(AIRCRAFT.control_symbols)


def samples(count: int, start: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(start)
    return (start + np.arange(count)) / 200.0, rng.normal(size=(count, WIDTH)), np.full((count, 3), np.nan)


def test_a_short_flight_is_kept_whole() -> None:
    kept = RecordedSamples(AIRCRAFT, 300)
    for start in (0, 100, 200):
        kept.add(*samples(100, start))
    flight = kept.flight
    assert flight is not None
    assert len(flight) == kept.count == 300
    assert kept.seconds == 299 / 200.0
    np.testing.assert_array_equal(kept.last[1][100:200], samples(100, 100)[1])
    np.testing.assert_array_equal(flight["de"][200:], samples(100, 200)[1][:, len(SAMPLE_COLUMNS)])
    assert not flight.measured("phi")
    assert kept.remarks == []


def test_of_a_long_flight_peaks_and_the_last_samples_are_kept() -> None:
    step, count = 25_000, 2 * MOST
    kept = RecordedSamples(AIRCRAFT, count)
    for start in range(0, count, step):
        time, values, attitude = samples(step, start)
        if start == step:
            values[1234, 0] = 99.0
        kept.add(time, values, attitude)
    flight = kept.flight
    assert flight is not None
    assert len(flight) < MOST / 5
    assert flight["ax"].max() == 99.0
    assert flight.time[[0, -1]].tolist() == [0.0, (count - 1) / 200.0]
    time, values = kept.last
    assert MOST <= time.size < MOST + step
    np.testing.assert_array_equal(values[-step:], samples(step, count - step)[1])
    (remark,) = kept.remarks
    assert "last 12 minutes" in remark or "last 13 minutes" in remark
