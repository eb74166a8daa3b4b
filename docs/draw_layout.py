"""Draws what a Foxglove layout shows of recorded messages: ``python docs/draw_layout.py``, a minute.

The layout file's panels stand where the file places them, and each curve is its message path, evaluated on the messages
of a bundled flight and of the estimates that ``sysid replay`` writes beside it. It is no picture of Foxglove.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.highlevel import AnyReader
from svg import GREY, INK, MUTED, Chart, document, legend, text

from sysid_node.flight.bag.message_types import type_store

ROOT = Path(__file__).resolve().parents[1]
WIDTH, HEIGHT, TOP = 1200.0, 760.0, 34.0
POINTS = 300  # of a curve
Rows = list[tuple[float, Any]]  # seconds and message


class Place(NamedTuple):
    """A panel's rectangle."""

    x: float
    y: float
    width: float
    height: float


def main() -> None:
    """Replays the flight where it was not replayed yet, and draws the identifier's layout."""
    run = ROOT / "out" / "pictures" / "replay"
    if not run.exists():
        command = ["replay", "bags/cdrw_multistep", "--aircraft", "cdrw", "--out", str(run)]
        subprocess.run([sys.executable, "-m", "sysid_node.cli", *command], cwd=ROOT, check=True)
    bags = [ROOT / "bags" / "cdrw_multistep", run / "estimates"]
    layout = ROOT / "config" / "layouts" / "foxglove_identifier.json"
    (ROOT / "docs" / "figures" / "layout_identifier.svg").write_text(drawn(layout, bags), encoding="utf-8")


def drawn(layout: Path, bags: Sequence[Path]) -> str:
    """The layout filled with the bags' messages, as SVG."""
    content = json.loads(layout.read_text(encoding="utf-8"))
    places = dict(_places(content["layout"], Place(0.0, TOP, WIDTH, HEIGHT - TOP)))
    panels = content["configById"]
    wanted = {topic_of(path["value"]) for panel in panels.values() for path in panel.get("paths", ())}
    messages = read(bags, wanted)
    note = f"{layout.name}, filled with the messages of the bundled flight {bags[0].name}; drawn by sysid"
    parts = [text(12, 22, note, 13, MUTED)]
    for name, place in places.items():
        parts += _panel(name, panels[name], place, messages)
    return document(WIDTH, HEIGHT, note, parts)


def topic_of(path: str) -> str:
    """The topic of a message path, which ends before the first dot."""
    return path.partition(".")[0]


def read(bags: Sequence[Path], topics: set[str]) -> dict[str, Rows]:
    """The messages of the topics, each with the seconds since the first of all, by its header's stamp."""
    found: dict[str, Rows] = {topic: [] for topic in topics}
    for bag in bags:
        with AnyReader([bag], default_typestore=type_store()) as reader:
            kept = [c for c in reader.connections if c.topic in topics]
            for connection, _, data in reader.messages(connections=kept):
                message: Any = reader.deserialize(data, connection.msgtype)
                stamp = message.header.stamp
                found[connection.topic].append((stamp.sec + 1e-9 * stamp.nanosec, message))
    start = min(rows[0][0] for rows in found.values() if rows)
    return {topic: [(time - start, message) for time, message in rows] for topic, rows in found.items()}


def value_of(message: Any, path: str) -> float:
    """What a message path stands for in one message: fields, an index, or all elements with a filter."""
    for name, index, key, wanted in re.findall(r'\.(\w+)(?:\[(-?\d+|:)\])?(?:\{(\w+)=="([^"]*)"\})?', path):
        message = getattr(message, name)
        if key:
            message = next(item for item in message if getattr(item, key) == wanted)
        elif index:
            message = message[int(index)]
    return float(message)


def _places(node: Any, place: Place) -> Iterator[tuple[str, Place]]:
    """The rectangles of all panels in a tree of divisions."""
    if isinstance(node, str):
        yield node, place
        return
    share = node.get("splitPercentage", 50.0) / 100.0
    if node["direction"] == "row":
        first = Place(place.x, place.y, share * place.width, place.height)
        rest = Place(place.x + first.width, place.y, place.width - first.width, place.height)
    else:
        first = Place(place.x, place.y, place.width, share * place.height)
        rest = Place(place.x, place.y + first.height, place.width, place.height - first.height)
    yield from _places(node["first"], first)
    yield from _places(node["second"], rest)


def _panel(name: str, panel: Mapping[str, Any], place: Place, messages: Mapping[str, Rows]) -> list[str]:
    x, y, width, height = place
    parts = [f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" fill="none" stroke="{GREY}"/>']
    title = panel.get("foxglovePanelTitle") or f"{name.partition('!')[0]}: {panel.get('topicToRender', '')}"
    parts.append(text(x + 10, y + 18, title, 12, INK, font_weight="bold"))
    curves = [curve for path in panel.get("paths", ()) if (curve := _curve(path, messages)) is not None]
    if not curves:
        return [*parts, text(x + 10, y + 40, "not recorded in this flight", 12, MUTED)]
    low, high = _range([values for *_, values in curves])
    end = max(times[-1] for *_, times, _ in curves)
    chart = Chart((x + 48, y + 44, width - 62, height - 72), (0.0, end), (low, high))
    chart.frame("", "", [*np.arange(0.0, end + 0.1, 20.0)], [low, high])
    for _, colour, times, values in curves:
        runs = np.flatnonzero((values >= low) & (values <= high))
        for begin, stop in pairwise([0, *(np.flatnonzero(np.diff(runs) > 1) + 1), runs.size]):
            part = runs[begin:stop]
            chart.line(times[part].tolist(), values[part].tolist(), colour, 1.3)
    return [*parts, *chart.parts, legend(x + 10, y + 36, [(colour, label) for label, colour, *_ in curves])]


def _curve(path: Mapping[str, Any], messages: Mapping[str, Rows]) -> tuple[str, str, Any, Any] | None:
    """Label, colour, times (N,) and values (N,) of a curve; None where the topic was not recorded."""
    rows = messages[topic_of(path["value"])]
    if not rows:
        return None
    chosen = [rows[k] for k in np.unique(np.linspace(0, len(rows) - 1, POINTS).astype(int))]
    values = np.array([value_of(message, path["value"]) for _, message in chosen])
    return path["label"], path["color"], np.array([time for time, _ in chosen]), values


def _range(curves: Sequence[Any]) -> tuple[float, float]:
    """A range that shows the later two thirds of the curves, rounded outwards to two digits."""
    known = np.concatenate([values[len(values) // 3 :] for values in curves])
    low, high = float(np.nanmin(known)), float(np.nanmax(known))
    step = 10.0 ** np.floor(np.log10(max(high - low, 1e-9) / 2.0))
    return float(np.floor(low / step) * step), float(np.ceil(high / step) * step)


if __name__ == "__main__":
    main()
