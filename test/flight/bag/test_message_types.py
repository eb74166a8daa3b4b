"""The type store holds sysid_msgs as its .msg files define it, wherever they are."""

import json
import os
import re
import shutil
import sys
from pathlib import Path

import pytest

from sysid_node.errors import InputError
from sysid_node.flight.bag import message_types

SOURCE = Path(__file__).resolve().parents[3] / "msg_defs" / "msg"


def test_every_msg_file_is_a_type_with_its_fields():
    store = message_types.type_store()
    files = sorted(SOURCE.glob("*.msg"))
    assert len(files) >= 5
    for path in files:
        lines = (re.sub("#.*", "", line).split() for line in path.read_text().splitlines())
        wanted = [words[1] for words in lines if len(words) == 2]
        assert [name for name, _ in store.fielddefs[f"sysid_msgs/msg/{path.stem}"][1]] == wanted


def test_found_where_the_package_is_installed(tmp_path, monkeypatch):
    share = tmp_path / "share" / "sysid_msgs" / "msg"
    shutil.copytree(SOURCE, share)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path}")
    installed = tmp_path / "site-packages/sysid_node/flight/bag/message_types.py"
    assert message_types.message_folder(installed) == share


def test_not_found_says_what_to_build(tmp_path, monkeypatch):
    monkeypatch.setenv("AMENT_PREFIX_PATH", "")
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    with pytest.raises(InputError, match=r"sysid_msgs.*build"):
        message_types.message_folder(tmp_path / "a/b/c/messages.py")


def test_types_are_those_that_ros_itself_generated():
    """Type hashes (REP-2016) of the built package, where there is one."""
    built = [
        Path(p) / "share/sysid_msgs/msg" for p in (*os.environ.get("AMENT_PREFIX_PATH", "").split(":"), sys.prefix)
    ]
    files = [path for folder in built for path in folder.glob("*.json")]
    if not files:
        pytest.skip("sysid_msgs is not built (make build)")
    for path in files:
        name = f"sysid_msgs/msg/{path.stem}"
        hashes = {entry["type_name"]: entry["hash_string"] for entry in json.loads(path.read_text())["type_hashes"]}
        assert message_types.type_store().hash_rihs01(name) == hashes[name]
