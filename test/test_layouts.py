"""Every topic and field of the layouts for Foxglove and PlotJuggler exists. Truth: the message definitions."""

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.flight.bag.message_types import type_store

LAYOUTS = Path(__file__).parents[1] / "config" / "layouts"
JOINTS, DIAGNOSTICS = "sensor_msgs/msg/JointState", "diagnostic_msgs/msg/DiagnosticArray"
TOPICS = {
    "/imu/data": "sensor_msgs/msg/Imu",
    "/air_data": "sysid_msgs/msg/AirData",
    "/actuators": JOINTS,
    "/actuators/command": JOINTS,
    "/actuators/excitation": JOINTS,
    "/adaptive_controller/tracking": JOINTS,
    "/identifier/derivatives": "sysid_msgs/msg/DerivativeEstimates",
    "/identifier/model_gap": "sysid_msgs/msg/ModelGap",
    "/fault_monitor/faults": DIAGNOSTICS,
    "/diagnostics": DIAGNOSTICS,
}


def strings(value: Any) -> Iterator[str]:
    """Every text of a JSON value that names a topic."""
    if isinstance(value, dict):
        for part in value.values():
            yield from strings(part)
    elif isinstance(value, list):
        for part in value:
            yield from strings(part)
    elif isinstance(value, str) and value.startswith("/"):
        yield value


#: A message path as docs.foxglove.dev describes it: fields, indices, slices and filters.
PATH = re.compile(r'/\w+(/\w+)*(\.\w+(\[(-?\d+|\d*:\d*)\])?(\{\w+==("[^"]*"|-?\d+)\})?)*')
#: What a panel keeps, as Lichtblick, the open branch of Foxglove, declares it (PlotConfig, RawMessagesPanelConfig,
#: DiagnosticSummaryConfig); the two programs have a key of their own for a panel's title.
KEPT = {
    "Plot": {
        "foxglovePanelTitle", "lichtblickPanelTitle", "paths", "showLegend", "legendDisplay", "showPlotValuesInLegend",
        "showXAxisLabels", "showYAxisLabels", "isSynced", "xAxisVal", "sidebarDimension",
    },
    "RawMessages": {
        "diffEnabled", "diffMethod", "diffTopicPath", "expansion", "showFullMessageForDiff", "topicPath",
    },
    "DiagnosticSummary": {"minLevel", "pinnedIds", "topicToRender", "hardwareIdFilter", "sortByLevel"},
}  # fmt: skip


def topic_of(path: str) -> str:
    """The longest known topic with which a path begins."""
    found = [t for t in TOPICS if path == t or path.startswith((t + ".", t + "/"))]
    assert found, f"{path}: no such topic"
    return max(found, key=len)


def require_fields(msgtype: str, names: list[str]) -> None:
    """Each name is a field of the type that the one before it leads to."""
    for name in names:
        fields = dict(type_store().fielddefs[msgtype][1])
        assert name in fields, f"{msgtype} has no field {name}"
        node: Any = fields[name]
        while isinstance(node[1], tuple) and not isinstance(node[1][0], str):
            node = node[1][0]
        msgtype = node[1] if isinstance(node[1], str) else ""


@pytest.mark.parametrize("layout", sorted(LAYOUTS.glob("foxglove_*.json")), ids=lambda path: path.stem)
def test_foxglove_paths_exist(layout: Path) -> None:
    content = json.loads(layout.read_text())
    paths = list(strings(content["configById"]))
    assert len(paths) > 10
    for path in paths:
        assert PATH.fullmatch(path), path
        topic = topic_of(path)
        wanted = re.findall(r'name=="(\w+)"', path)
        assert set(wanted) <= set(load_aircraft("cdrw").derivatives)
        plain = re.sub(r"\[[^\]]*\]|\{[^}]*\}", "", path[len(topic) :])
        require_fields(TOPICS[topic], [name for name in plain.split(".") if name])
    assert set(re.findall(r'"(\w+!\w+)"', json.dumps(content["layout"]))) == set(content["configById"])


@pytest.mark.parametrize("layout", sorted(LAYOUTS.glob("foxglove_*.json")), ids=lambda path: path.stem)
def test_foxglove_panels_have_the_keys_that_are_read(layout: Path) -> None:
    """Every curve has a name and a colour, and those of the gap are the coefficients in the message's order."""
    for name, panel in json.loads(layout.read_text())["configById"].items():
        kind = name.partition("!")[0]
        assert set(panel) == KEPT[kind], name
        if kind != "Plot":
            continue
        assert panel["foxglovePanelTitle"] == panel["lichtblickPanelTitle"] != ""
        labels = [path["label"] for path in panel["paths"]]
        assert len(set(labels)) == len(labels)
        assert all(re.fullmatch("#[0-9a-f]{6}", path["color"]) for path in panel["paths"])
        if "model_gap" in panel["paths"][0]["value"]:
            assert labels == list(COEFFICIENTS)


@pytest.mark.parametrize("layout", sorted(LAYOUTS.glob("plotjuggler_*.xml")), ids=lambda path: path.stem)
def test_plotjuggler_splitters_are_as_it_restores_them(layout: Path) -> None:
    """PlotJuggler 3 divides a splitter into ``count`` parts, with a share of ``sizes`` for each."""
    tabs = ET.parse(layout).getroot().find("tabbed_widget[@parent='main_window']")
    assert tabs is not None
    for splitter in tabs.iter("DockSplitter"):
        assert splitter.attrib["orientation"] in "|-"
        assert int(splitter.attrib["count"]) == len(splitter) == len(splitter.attrib["sizes"].split(";"))
        assert {part.tag for part in splitter} <= {"DockArea", "DockSplitter"}
    assert all(len(tab.findall("Container/DockSplitter")) == 1 for tab in tabs.findall("Tab"))


@pytest.mark.parametrize("layout", sorted(LAYOUTS.glob("plotjuggler_*.xml")), ids=lambda path: path.stem)
def test_plotjuggler_curves_exist(layout: Path) -> None:
    """PlotJuggler names a joint's values after the joint, and counts the elements of other lists."""
    aircraft = load_aircraft("cdrw")
    joints = {joint for control in aircraft.controls.values() for joint in control.joints}
    areas = ET.parse(layout).getroot().iter("DockArea")
    count = 0
    for area in areas:
        for curve in area.iter("curve"):
            count += 1
            path = curve.attrib["name"]
            topic = topic_of(path)
            rest = path[len(topic) + 1 :]
            if TOPICS[topic] == JOINTS:
                name, field = rest.split("/")
                assert field == "position"
                assert topic.endswith("tracking") or name in joints
                continue
            place = re.match(r"derivatives\[(\d+)\]", rest)
            if place:  # the plot is named after the derivative
                assert list(aircraft.derivatives)[int(place[1])] == area.attrib["name"]
            require_fields(TOPICS[topic], re.sub(r"\[\d+\]", "", rest).split("/"))
    assert count > 10


def test_the_topics_are_those_that_are_recorded() -> None:
    pytest.importorskip("rclpy")
    from sysid_node.ros.recorder import TOPICS as RECORDED  # noqa: PLC0415

    recorded = {f"/{name.lstrip('/')}": kind for name, kind in RECORDED.items()}
    assert recorded.items() >= TOPICS.items()
