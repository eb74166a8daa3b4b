"""Paths of users: a home directory where they write one."""

from pathlib import Path

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.user_path import user_path


def test_the_home_stands_for_a_tilde(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert user_path("~/flights") == tmp_path / "flights"
    assert user_path("flights/~") == Path("flights/~")
    with pytest.raises(InputError, match=f"{tmp_path}/mine.yaml: not found"):
        load_aircraft("~/mine.yaml")


def test_a_user_who_does_not_exist_is_one_line() -> None:
    with pytest.raises(InputError, match=r"^~nobody_of_that_name/x.yaml: no home directory"):
        load_aircraft("~nobody_of_that_name/x.yaml")
