"""The program ``view``: shows a flight in the viewer Rerun while it is flown and identified."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.live.processes import started
from sysid_node.cli.live.viewer_program import NICE, run_viewer, watched_flight
from sysid_node.flight.frames import BodyFrame
from sysid_node.interruption import on_interrupt
from sysid_node.parameter import AIRCRAFT, BODY_FRAME, NodeParameter
from sysid_node.view.live import LiveScene
from sysid_node.view.recording import append, check_recording, open_file, open_window, require_rerun, say

if TYPE_CHECKING:
    from sysid_node.ros.support.flight_watch import FlightWatch

PARAMETERS = (
    AIRCRAFT,
    BODY_FRAME,
    NodeParameter(
        "save",
        "",
        "",
        "The file to write (.rrd), without a window; empty: a window.",
        "Where there is no screen, or to look again later.",
    ),
)

#: What ``--view`` stands for without a file: a window.
WINDOW = Path("-")

PERIOD = 0.2  # s between two updates of the screen
LOG = "view.log"
_PATIENCE = 5.0  # s for the viewer to take the last news


def watch_live(aircraft: Aircraft, save: Path | None, frame: BodyFrame) -> None:
    """Show the flight until the process is interrupted, or write it into a file. Raises InputError."""
    import rclpy  # noqa: PLC0415  # reads its domain from the environment
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415

    from sysid_node.ros.support.flight_watch import FlightWatch  # noqa: PLC0415

    os.nice(NICE)
    scene = LiveScene(aircraft)
    stream = _opened(scene, save)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    watch = FlightWatch(frame)
    with on_interrupt(lambda: _end(stream)):
        _show(scene, watch, stream)
    watch.close()


def _opened(scene: LiveScene, save: Path | None) -> Any:
    """The recording into which the scene goes: a window, or a file. Raises InputError."""
    if save is None:
        return open_window(scene.declared)
    check_recording(save)
    return open_file(scene.declared, save)


def _show(scene: LiveScene, watch: FlightWatch, stream: Any) -> None:
    """Add what the watch hears to the recording, until ROS is shut down."""
    import rclpy  # noqa: PLC0415

    words = ""
    try:
        while rclpy.ok():
            watch.listen(PERIOD)
            news = scene.update(watch.start_ns, *watch.take(), watch.faults)
            append(stream, news)
            if news.about != words:
                say(stream, news.about)
            words = news.about
    finally:
        _end(stream)


def _end(stream: Any) -> None:
    """Send what has not been sent yet, as far as the viewer takes it: one that hangs must not hold a flight's end."""
    try:
        stream.flush(timeout_sec=_PATIENCE)
    except RuntimeError:
        return  # disconnecting would wait for it as well
    stream.disconnect()


@contextmanager
def viewer_beside(aircraft: str, wanted: Path | None, folder: Path) -> Iterator[None]:
    """The live view in a process of its own while the context lasts, its log in ``folder``; none for None.

    ``wanted``: the file to write, or ``WINDOW``. Raises InputError at once where the viewer is not installed.
    """
    if wanted is None:
        yield
        return
    require_rerun()
    command = [sys.executable, "-m", "sysid_node.cli", "view", "--live", "--aircraft", aircraft]
    command += [] if wanted == WINDOW else ["--save", str(wanted)]
    # SIGINT is ignored by what a shell starts in the background
    with (folder / LOG).open("wb") as log, started(command, log, signal.SIGTERM):
        yield


def main() -> None:
    """Entry point of ``ros2 run sysid_node view``."""
    run_viewer("view", __doc__ or "", PARAMETERS, _serve)


def _serve() -> None:
    require_rerun()
    with watched_flight(PARAMETERS) as (watch, given):
        scene = LiveScene(load_aircraft(given["aircraft"]))
        _show(scene, watch, _opened(scene, Path(given["save"]) if given["save"] else None))
