"""Scenes as Rerun's recordings: saved to a file, shown in a window, or sent while a flight goes on.

Entities: ``/world/NAME`` (where an aircraft is; below it ``body`` turns, with its parts and arrows),
``/world/way_NAME``, ``/TAB/PANEL/CURVE``, ``/lanes/NAME``, ``/notes`` and ``/about``. All data lie on the time line
``flight``, in s.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.record import Array
from sysid_node.interruption import indivisible, on_interrupt
from sysid_node.view.aircraft_mesh import MovingPart, airframe, surfaces
from sysid_node.view.entities import ABOUT, APPLICATION, NOTES, TIMELINE, WORLD, curve_path, lane_path, part, place_path
from sysid_node.view.scene import GREY, NOTHING, Arrow, Body, DrawnAircraft, PlotCurve, Scene

if TYPE_CHECKING:
    import rerun

#: How a recording begins.
_MAGIC = b"RRF"

#: Radius of the line of a way, m.
_WAY = 0.01


def require_rerun() -> Any:
    """The module ``rerun``. Raises InputError, in one line, where it is not installed."""
    if find_spec("rerun") is None:
        raise InputError("the viewer needs rerun-sdk, which is not installed: pip install -r requirements/view.txt")
    import rerun  # noqa: PLC0415  # takes half a second

    return rerun


def new_recording(title: str) -> rerun.RecordingStream:
    """A recording with a title, which is sent nowhere yet."""
    rr = require_rerun()
    stream: rerun.RecordingStream = rr.RecordingStream(APPLICATION)
    rr.send_recording_name(title, recording=stream)
    return stream


def save(scene: Scene, path: Path) -> None:
    """Write a scene as an ``.rrd`` file, aside and then moved into place, over an earlier recording of that name.

    Raises InputError where the file cannot be written, or is there and holds something else.
    """
    check_recording(path)
    aside = path.with_name(f".{path.name}.unfinished")
    try:
        with on_interrupt(lambda: aside.unlink(missing_ok=True)):
            with indivisible():  # else it could be made once more after a signal has removed it
                stream = open_file(scene, aside)
            append(stream, scene)
            stream.flush()
            stream.disconnect()
            with indivisible():
                aside.replace(path)
    except OSError as error:
        raise InputError(f"--save {path}: cannot be written ({error.strerror}); give another file") from None
    finally:
        aside.unlink(missing_ok=True)


def check_recording(path: Path) -> None:
    """Raises InputError where a path is not to be written as a recording: another suffix, folder, or kind of file."""
    if path.suffix != ".rrd":
        raise InputError(f"--save {path}: expected the name of a file that ends in .rrd")
    try:
        other = path.is_file() and path.read_bytes()[: len(_MAGIC)] != _MAGIC
    except OSError as error:
        raise InputError(f"--save {path}: cannot be read ({error.strerror}); give another file") from None
    if path.is_dir() or not path.parent.is_dir():
        raise InputError(f"--save {path}: {path if path.is_dir() else path.parent} is no place for a file")
    if other:
        raise InputError(f"--save {path}: exists and holds something else; give another file")


def show(scene: Scene) -> None:
    """Open a scene in the viewer's window, which stays open when this program ends. Raises InputError."""
    stream = open_window(scene)
    append(stream, scene)
    stream.flush()


def open_window(scene: Scene) -> rerun.RecordingStream:
    """A recording that is sent to the viewer's window, with the scene declared. Raises InputError without a display."""
    from sysid_node.view.layout import blueprint  # noqa: PLC0415  # imports Rerun

    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError("no display to open the viewer on; write a file with --save FILE.rrd and open it where one is")
    rr, stream = require_rerun(), new_recording(scene.title)
    program = _viewer_program()
    without_usage_reports(program)
    rr.spawn(executable_path=program, hide_welcome_screen=True, default_blueprint=blueprint(scene), recording=stream)
    declare(stream, scene)
    return stream


def open_file(scene: Scene, path: Path) -> rerun.RecordingStream:
    """A recording that is written into a file as it goes on, with the scene declared. Raises InputError."""
    from sysid_node.view.layout import blueprint  # noqa: PLC0415  # imports Rerun

    stream = new_recording(scene.title)
    try:
        with path.open("wb"):
            pass  # Rerun would only log that it cannot write
    except OSError as error:
        raise InputError(f"--save {path}: cannot be written ({error.strerror}); give another file") from None
    stream.save(path, default_blueprint=blueprint(scene))
    declare(stream, scene)
    return stream


def say(stream: rerun.RecordingStream, words: str) -> None:
    """Replace the text (Markdown) beside the plots."""
    rr = require_rerun()
    _static(stream, ABOUT, rr.TextDocument(words, media_type=rr.MediaType.MARKDOWN))


def without_usage_reports(program: str) -> None:
    """Turns the viewer's usage reports off for this account, as ``rerun analytics disable`` does, where they are on."""
    run = subprocess.run([program, "analytics", "config"], capture_output=True, text=True, check=False)
    found = re.search(r"\{.*\}", run.stdout, re.DOTALL)
    if found is None or json.loads(found.group()).get("analytics_enabled", True):
        subprocess.run([program, "analytics", "disable"], capture_output=True, check=False)


def declare(stream: rerun.RecordingStream, scene: Scene) -> None:
    """Log what does not change in a flight: shapes, names and colours of curves and lanes, and the text."""
    rr = require_rerun()
    say(stream, scene.about)
    _static(stream, WORLD, rr.ViewCoordinates.FRD)
    for body in scene.bodies:
        _declare_body(stream, body, scene.shape)
    for tab, panels in scene.tabs.items():
        for panel in panels:
            for curve in panel.curves:
                style = rr.SeriesLines(colors=[curve.colour], names=[curve.name], widths=[curve.width])
                _static(stream, curve_path(tab, panel.title, curve.name), style)
    for lane in scene.lanes:
        states = sorted({change.state for change in lane.changes} - {NOTHING})
        style = rr.StateConfiguration(
            values=[NOTHING, *states],
            labels=[NOTHING, *states],
            colors=[(*GREY, 255), *[(*lane.colour, 255)] * len(states)],
            visible=[False, *[True] * len(states)],
        )
        _static(stream, lane_path(lane.name), style)


def append(stream: rerun.RecordingStream, scene: Scene) -> None:
    """Log the scene's data; to a recording that has some, this adds what happened since."""
    rr = require_rerun()
    for body in scene.bodies:
        _append_body(stream, body, surfaces(scene.shape))
    for tab, panels in scene.tabs.items():
        for panel in panels:
            for curve in panel.curves:
                _append_curve(stream, curve_path(tab, panel.title, curve.name), curve)
    for lane in scene.lanes:
        if lane.changes:
            times = np.array([change.time for change in lane.changes])
            states = [change.state for change in lane.changes]
            _send(stream, lane_path(lane.name), times, rr.StateChange.columns(state=states))
    for note in sorted(scene.notes):
        _at(stream, note.time)
        stream.log(NOTES, rr.TextLog(note.text, level=note.level))


def _static(stream: rerun.RecordingStream, path: str, archetype: Any) -> None:
    stream.log(path, archetype, static=True)


def _at(stream: rerun.RecordingStream, time: float) -> None:
    stream.set_time(TIMELINE, duration=time)


def _declare_body(stream: rerun.RecordingStream, body: Body, shape: DrawnAircraft) -> None:
    rr, root = require_rerun(), f"{place_path(body.name)}/body"
    parts = {"airframe": airframe(shape)} | {f"{s.name}/flap": s.mesh for s in surfaces(shape)}
    for name, mesh in parts.items():
        colour = body.colour if name == "airframe" else tuple(min(255, c + 70) for c in body.colour)
        drawn = rr.Mesh3D(vertex_positions=mesh.corners, vertex_normals=mesh.normals, albedo_factor=(*colour, 255))
        _static(stream, f"{root}/{name}", drawn)
    for surface in surfaces(shape):
        _static(stream, f"{root}/{surface.name}", rr.Transform3D(translation=surface.hinge))


def _append_body(stream: rerun.RecordingStream, body: Body, parts: list[MovingPart]) -> None:
    rr, place = require_rerun(), place_path(body.name)
    root = f"{place}/body"
    if body.time.size:
        turned = np.roll(body.attitude, -1, axis=1)  # Rerun's quaternions have the scalar last
        _send(stream, place, body.time, rr.Transform3D.columns(translation=body.position))
        _send(stream, root, body.time, rr.Transform3D.columns(quaternion=turned))
    for surface in parts:
        deflection = body.controls.get(surface.symbol)
        if deflection is not None and body.time.size:
            half = 0.5 * surface.sign * np.nan_to_num(deflection)
            turns = np.column_stack([np.sin(half)[:, None] * surface.axis, np.cos(half)])
            columns = rr.Transform3D.columns(translation=np.tile(surface.hinge, (len(turns), 1)), quaternion=turns)
            _send(stream, f"{root}/{surface.name}", body.time, columns)
    for arrow in body.arrows:
        _append_arrow(stream, f"{root}/{part(arrow.name)}", arrow)
    if body.path and body.time.size > 1:
        way = rr.LineStrips3D([body.position], colors=[body.colour], radii=[_WAY])
        stream.log(f"{WORLD}/way_{part(body.name)}", way, static=True)


def _append_arrow(stream: rerun.RecordingStream, path: str, arrow: Arrow) -> None:
    rr = require_rerun()
    if not arrow.time.size:
        return
    drawn = np.nan_to_num(arrow.vectors) * arrow.metres_per_unit
    style = rr.Arrows3D.from_fields(colors=[arrow.colour])
    _static(stream, path, style)
    _send(stream, path, arrow.time, rr.Arrows3D.columns(vectors=drawn))


def _append_curve(stream: rerun.RecordingStream, path: str, curve: PlotCurve) -> None:
    if curve.time.size:
        _send(stream, path, curve.time, require_rerun().Scalars.columns(scalars=curve.values))


def _send(stream: rerun.RecordingStream, path: str, time: Array, columns: Any) -> None:
    rr = require_rerun()
    rr.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], columns, recording=stream)


def _viewer_program() -> str:
    """The viewer of this Python environment, else the one on the path. Raises InputError where there is none."""
    beside = Path(sys.executable).with_name("rerun")
    found = str(beside) if beside.exists() else which("rerun")
    if found is None:
        raise InputError("the viewer's program 'rerun' is not found; install requirements/view.txt again")
    return found
