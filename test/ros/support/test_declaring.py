"""Values that ROS would hide: every value given for a parameter must have its type. Truth: rcl's rules of files."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid_node.errors import InputError
from sysid_node.given_values import fits, given_values
from sysid_node.parameter import NodeParameter
from sysid_node.ros.support.declaring import refuse_mistyped

TABLE = (
    NodeParameter("adapt", True, "", "", ""),
    NodeParameter("gain", 2.0, "", "", "", 0.0, 9.0),
    NodeParameter("method", "iv_rft", "", "", ""),
    NodeParameter("lines", [0.1, 0.04, 2.0], "Hz", "", ""),
)


def arguments(tmp_path: Path, text: str, *more: str) -> list[str]:
    path = tmp_path / "parameters.yaml"
    path.write_text(text, encoding="utf-8")
    return ["--ros-args", "-r", "__ns:=/uav1", "--params-file", str(path), *more]


FILE = "/**:\n  ros__parameters:\n    adapt: true\n    gain: 2.0\n    method: iv_rft\n    lines: [0.1, 0.04, 2.0]\n"


@pytest.mark.parametrize(
    "rule",
    [
        "adapt:=0",
        "adapt:=maybe",
        "gain:=high",
        "gain:=3",
        "method:=1",
        "lines:=fast",
        "node:adapt:=1",
        "adapt:=[true]",
        "adapt:={a: 1}",
    ],
)
def test_a_value_of_a_wrong_type_is_refused_over_a_file(tmp_path: Path, rule: str) -> None:
    name = rule.removeprefix("node:").partition(":=")[0]
    with pytest.raises(InputError, match=rf"parameter {name} = .*: expected .*; given on the command line"):
        refuse_mistyped(arguments(tmp_path, FILE, "-p", rule), "/uav1/node", TABLE)


@pytest.mark.parametrize("rule", ["adapt:=false", "adapt:=n", "gain:=1e3", "gain:=.5", "other:adapt:=0", "unknown:=0"])
def test_right_values_pass(tmp_path: Path, rule: str) -> None:
    """A wrong value that follows is refused, so the values are looked at."""
    given = arguments(tmp_path, FILE, "-p", rule)
    refuse_mistyped(given, "/uav1/node", TABLE)
    with pytest.raises(InputError, match="parameter method = 1 "):
        refuse_mistyped([*given, "-p", "method:=1"], "/uav1/node", TABLE)


@pytest.mark.parametrize(
    ("head", "hit"),
    [
        ("/**", True),
        ("node", False),
        ("/uav1/node", True),
        ("uav1:\n  node", True),
        ("/*/node", True),
        ("/**/node", True),
        ("/uav2/node", False),
    ],
)
def test_files_count_for_the_nodes_that_they_name(tmp_path: Path, head: str, hit: bool) -> None:
    outer, _, inner = head.partition(":\n")
    text = f"{outer}:\n{inner}{':' if inner else ''}\n    ros__parameters:\n      adapt: 0\n      a: {{b: 1}}\n"
    found = {given.name: given.value for given in given_values(arguments(tmp_path, text), "/uav1/node")}
    assert found == ({"adapt": 0, "a.b": 1} if hit else {})


@pytest.mark.slow
@given(text=st.text(max_size=12) | st.sampled_from(["2026-13-45", "1" * 5000, "[" * 2000, "&a [*a]", "!!set {a}"]))
def test_whatever_is_given_is_read_or_left_to_ros(text: str) -> None:
    for one in given_values(["--ros-args", "-p", f"adapt:={text}"], "/node"):
        assert fits(one.value, True) in (True, False)


def test_what_ros_refuses_itself_is_left_to_it(tmp_path: Path) -> None:
    assert list(given_values(["--ros-args", "--params-file", str(tmp_path), "-p", "a:=[", "-p", "b"], "/node")) == []
    assert list(given_values(["-p", "a:=1"], "/node")) == [], "not an argument of ROS"
