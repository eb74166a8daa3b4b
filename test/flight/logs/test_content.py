"""What a file holds is told by its content, whatever its name."""

from pathlib import Path

import pytest

from sysid_node.errors import InputError
from sysid_node.flight.logs.content import Content, content_of

BAGS = Path(__file__).resolve().parents[3] / "bags"


@pytest.mark.parametrize(
    ("head", "content"),
    [
        (b"ULog\x01\x12\x35\x01" + bytes(8), Content.ULOG),
        (b"\xa3\x95\x80\x80\x59FMT\x00", Content.DATAFLASH),
        (b"FMT, 128, 89, FMT, BBnNZ, Type,Length\n", Content.DATAFLASH_TEXT),
        (b"#ROSBAG V2.0\n", Content.ROSBAG1),
        (b"\x89MCAP0\r\n", Content.ROSBAG2),
        (b"SQLite format 3\x00", Content.ROSBAG2),
        (b"\x00\x05\x80\xc0\x11\x22\x33\x44\xfd\x09\x00\x00", Content.TELEMETRY),
        (b"t,ax,ay\n0,1,2\n", Content.TABLE),
    ],
)
def test_first_bytes_decide(tmp_path, head, content):
    (tmp_path / "flight.csv.bag").write_bytes(head)
    assert content_of(tmp_path / "flight.csv.bag") is content


def test_folders_and_missing_paths_are_bags():
    assert content_of(BAGS / "cdrw_multistep") is Content.ROSBAG2
    assert content_of(BAGS / "nowhere") is Content.ROSBAG2


@pytest.mark.parametrize(("head", "said"), [(b"", "is empty"), (b"\x7fELF\x02\x01", "is no flight that can be read")])
def test_what_is_no_flight_is_one_line(tmp_path, head, said):
    (tmp_path / "thing.log").write_bytes(head)
    with pytest.raises(InputError, match=said):
        content_of(tmp_path / "thing.log")
