"""Remote logs: a copy for each content, made once and whole."""

from pathlib import Path

import fsspec
import pytest

from sysid_node.errors import InputError
from sysid_node.fleet.catalogue.locations import exists, expanded, local_copy


def test_a_remote_log_is_copied_once_and_again_when_it_changes(tmp_path: Path) -> None:
    memory = fsspec.filesystem("memory")
    memory.pipe("/bucket/flight.csv", b"time,p\n0,1\n")
    first = local_copy("memory://bucket/flight.csv", tmp_path)
    assert first.read_bytes() == b"time,p\n0,1\n"
    assert local_copy("memory://bucket/flight.csv", tmp_path) == first
    memory.pipe("/bucket/flight.csv", b"time,p\n0,2\n")
    second = local_copy("memory://bucket/flight.csv", tmp_path)
    assert (second != first, second.read_bytes()) == (True, b"time,p\n0,2\n")
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_a_folder_is_copied_with_its_files(tmp_path: Path) -> None:
    memory = fsspec.filesystem("memory")
    memory.pipe({"/bag/metadata.yaml": b"x", "/bag/0.mcap": b"y"})
    copy = local_copy("memory://bag", tmp_path)
    assert sorted(path.name for path in copy.iterdir()) == ["0.mcap", "metadata.yaml"]


def test_a_path_of_this_machine_is_itself(tmp_path: Path) -> None:
    assert local_copy(str(tmp_path / "a.csv"), tmp_path) == tmp_path / "a.csv"


def test_a_name_that_no_file_system_can_have_is_not_there(tmp_path: Path) -> None:
    name = "x" * 5000
    assert expanded(name, tmp_path) == [str(tmp_path / name)]
    assert not exists(str(tmp_path / name))


@pytest.mark.parametrize("location", ["none://x/y", "memory://nothing/there.csv"])
def test_what_cannot_be_fetched_is_one_line(tmp_path: Path, location: str) -> None:
    with pytest.raises(InputError, match=f"{location}: cannot be opened"):
        local_copy(location, tmp_path)
