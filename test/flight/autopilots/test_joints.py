"""The map from outputs to joints, and what is wrong with one."""

import re
from pathlib import Path

import pytest

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import AdapterSettings, adapter_for
from sysid_node.flight.autopilots.joints import Joint, joints_of
from sysid_node.flight.autopilots.known import ADAPTERS

OUTPUTS = ("out1", "out2")


def test_words_become_joints() -> None:
    joints = joints_of(" a=out1:1500:1e-3  b=out2:0:-0.4 ", OUTPUTS, "a=out1:0:1")
    assert joints == (Joint("a", "out1", 1500.0, 0.001), Joint("b", "out2", 0.0, -0.4))
    assert joints[0].position(1700.0) == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty: say which output moves which joint and how far, e.g. 'a=out1:0:1'"),
        ("a", "'a' is not NAME=OUTPUT:TRIM:SCALE"),
        ("a=out1", "is not NAME"),
        ("a=out1:0", "is not NAME"),
        ("a=out1:0:x", "is not NAME"),
        ("a=out1:0:nan", "is not NAME"),
        ("a=out1:0:0", "is not NAME"),
        ("=out1:0:1", "is not NAME"),
        ("a=out3:0:1", "no output 'out3'; expected out1 to out2"),
        ("a=out1:0:1 a=out2:0:1", "'a' is given twice"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(text: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        joints_of(text, OUTPUTS, "a=out1:0:1")
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("autopilot", ADAPTERS)
def test_every_example_is_one(autopilot: str) -> None:
    adapter = adapter_for(autopilot, ADAPTERS, AdapterSettings(joints=ADAPTERS[autopilot].example))
    assert {joint.name for joint in adapter.joints} == {"aileron", "elevator", "rudder", "throttle"}


def test_the_page_shows_maps_that_are_accepted() -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "how-to" / "autopilots.md").read_text(encoding="utf-8")
    shown = [text for text in re.findall(r'joints(?::=| )"([^"]+)"', page) if text != "..."]
    assert len(shown) == 3
    for text in shown:
        autopilot = "px4" if "servo" in text else "mavros"
        assert adapter_for(autopilot, ADAPTERS, AdapterSettings(joints=text.removesuffix(" ..."))).joints


def test_an_unknown_autopilot_is_named() -> None:
    with pytest.raises(InputError, match="'paparazzi': expected one of px4, mavros, rosflight"):
        adapter_for("paparazzi", ADAPTERS, AdapterSettings())
