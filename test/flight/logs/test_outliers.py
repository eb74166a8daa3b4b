"""Single stamps of another time: a flipped bit must not refuse a log."""

import struct

import numpy as np
import pytest
from simulated_logs import aircraft, dataflash_log, flight, microseconds, px4_log

from sysid_node.flight.logs.opening import load_flight_record, open_log
from sysid_node.flight.logs.outliers import in_order


@pytest.mark.parametrize(
    ("seconds", "dropped"),
    [
        ([0.0, 0.1, 0.2, 0.3, 0.4], []),
        ([0.0, 0.1, 90.0, 0.3, 0.4], [2]),
        ([50.0, 50.1, 3.0, 50.3, 50.4], [2]),
        ([90.0, 0.1, 0.2, 0.3, 0.4], [0]),
        ([50.0, 50.1, 50.2, 50.3, 3.0], [4]),
        ([50.0, 50.1, 50.2, 3.0, 3.1, 3.2], []),  # a clock that was set back
        ([0.0, 0.1, 0.2, 90.0, 90.1], []),  # a pause
        ([0.0, 5.0, 10.0, 15.0], []),  # a slow message
        ([0.0, 90.0], []),
    ],
)
def test_single_stamps_are_told_from_clocks_that_were_set(seconds, dropped):
    keep = in_order(np.round(np.array(seconds) * 1e9).astype(np.int64))
    assert np.flatnonzero(~keep).tolist() == dropped


@pytest.mark.parametrize(("write", "name"), [(px4_log, "flight.ulg"), (dataflash_log, "flight.bin")])
def test_a_flipped_bit_refuses_no_log(tmp_path, write, name):
    """Truth: the log without it. Of the stamp of an IMU message in the midst, a bit is set that adds 13 days."""
    write(tmp_path / name)
    whole = load_flight_record(tmp_path / name, aircraft())
    content = bytearray((tmp_path / name).read_bytes())
    stamp = struct.pack("<Q", int(microseconds(flight())[len(flight()) // 4 * 2]))
    place = content.index(stamp)
    place = place if write is px4_log else content.index(stamp, place + 1)  # the second is of the primary IMU
    content[place + 5] |= 1
    (tmp_path / name).write_bytes(content)
    found = load_flight_record(tmp_path / name, aircraft())
    assert found.duration == pytest.approx(whole.duration, abs=0.05)
    assert len(whole) - 2 <= len(found) < len(whole)
    said = "1 messages with a stamp of another time than those around them are left out"
    assert said in open_log(tmp_path / name).remarks
