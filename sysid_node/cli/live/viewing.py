"""The program ``view``: shows a flight in the viewer Rerun while it is flown and identified."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.frames import BodyFrame
from sysid_node.interruption import on_interrupt
from sysid_node.view.live import LiveScene
from sysid_node.view.recording import append, check_recording, open_file, open_window, require_rerun, say

#: What ``--view`` stands for without a file: a window.
WINDOW = Path("-")

PERIOD = 0.2  # s between two updates of the screen
LOG = "view.log"
_NICE = 10  # lower priority than the identifier's: on a busy computer the screen waits, not the flight


def watch_live(aircraft: Aircraft, save: Path | None, frame: BodyFrame, arguments: list[str] | None = None) -> None:
    """Show the flight until ROS is shut down or the process is interrupted, or write it into a file.

    ``arguments``: those of a program that ROS itself interrupts; None for a command. Raises InputError.
    """
    import rclpy  # noqa: PLC0415  # reads its domain from the environment
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415

    from sysid_node.ros.support.flight_watch import FlightWatch  # noqa: PLC0415

    os.nice(_NICE)
    scene = LiveScene(aircraft)
    if save is not None:
        check_recording(save)
    stream: Any = open_window(scene.declared) if save is None else open_file(scene.declared, save)
    handlers = SignalHandlerOptions.NO if arguments is None else SignalHandlerOptions.ALL
    rclpy.init(args=arguments, signal_handler_options=handlers)
    watch, words = FlightWatch(frame), ""
    with on_interrupt(lambda: _end(stream)):
        while rclpy.ok():
            watch.listen(PERIOD)
            news = scene.update(watch.start_ns, *watch.take(), watch.faults)
            append(stream, news)
            if news.about != words:
                say(stream, news.about)
            words = news.about
    watch.close()
    _end(stream)


def _end(stream: Any) -> None:
    """Send what has not been sent yet."""
    stream.flush()
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
    with (folder / LOG).open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        try:
            yield
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()


def main() -> None:
    """Entry point of ``ros2 run sysid_node view``: its parameters are ``aircraft``, ``save`` and ``body_frame``."""
    import rclpy  # noqa: PLC0415

    rclpy.init()
    node = rclpy.create_node("view_parameters")
    given = {name: str(node.declare_parameter(name, default).value)
             for name, default in (("aircraft", ""), ("save", ""), ("body_frame", "flu"))}  # fmt: skip
    node.destroy_node()
    rclpy.try_shutdown()
    try:
        if not given["aircraft"]:
            raise InputError("parameter aircraft: needed, e.g. --ros-args -p aircraft:=cdrw")
        if given["body_frame"] not in ("flu", "frd"):
            raise InputError(f"parameter body_frame: {given['body_frame']!r}; expected flu or frd")
        save = Path(given["save"]) if given["save"] else None
        watch_live(load_aircraft(given["aircraft"]), save, given["body_frame"], sys.argv)  # type: ignore[arg-type]
    except InputError as error:
        print(f"view: {error}", file=sys.stderr)
        sys.exit(2)
