"""A flight's file, its aircraft, and how to read it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.api.data_frames import data_frame
from sysid_node.errors import InputError
from sysid_node.flight.align import MAX_GAP
from sysid_node.flight.frames import BODY_FRAMES, BodyFrame
from sysid_node.flight.logs.opening import load_flight_record
from sysid_node.flight.record import FlightRecord
from sysid_node.flight.topics import topic_names

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

T = TypeVar("T")


@dataclass(frozen=True)
class FlightFile:
    """A bag or a log of one flight. ``topics`` holds the absolute name of each input topic in the bag."""

    path: Path
    aircraft: Aircraft
    topics: Mapping[str, str]
    body_frame: BodyFrame

    @property
    def name(self) -> str:
        """The file's or the folder's name."""
        return self.path.name

    @cached_property
    def record(self) -> FlightRecord:
        """The aligned samples: SI units and radians, body axes forward-right-down. Raises InputError."""
        return self.aligned(max_gap=MAX_GAP)

    def aligned(self, max_gap: float, carried: str = "auto") -> FlightRecord:
        """The samples, those left out that stand more than ``max_gap`` s from a message. Raises InputError.

        ``carried``: what the actuators' messages are: "commands", "positions", or "auto" (told from the messages).
        """
        record = load_flight_record(
            self.path, self.aircraft, topics=self.topics, frame=self.body_frame, max_gap=max_gap, carried=carried
        )
        return replace(record, name=self.name)

    def plot(self) -> Figure:
        """Deflections and motion against time, as the report of a replay draws them."""
        from sysid_node.report.drawing.plotly_figure import plotly_figure  # noqa: PLC0415
        from sysid_node.report.sections.excitation import histories  # noqa: PLC0415

        return plotly_figure(histories(self.record), columns=2)

    def to_pandas(self) -> Any:
        """The aligned samples as a DataFrame, by time (s). Raises ImportError where pandas is not installed."""
        record = self.record
        return data_frame(dict(record.columns), index=record.time, index_name="time")

    def __repr__(self) -> str:
        record = self.record
        measured = ", ".join(name for name in record.columns if record.measured(name))
        return f"{self.name} of {self.aircraft.name}: {record.duration:.1f} s, {len(record)} samples of {measured}"


def load(
    path: str | Path,
    aircraft: str | Path | Aircraft,
    *,
    topics: Iterable[str] = (),
    body_frame: BodyFrame = "flu",
) -> FlightFile:
    """A flight's file with its aircraft; its samples are read when they are first needed.

    ``path``: whatever is a flight, told by its content: a bag (ROS 1 or 2), a PX4 or ArduPilot log, a CSV table.
    ``aircraft``: an aircraft file, the name of one that is shipped, or an ``Aircraft``. ``topics``: names in the bag,
    as ``"imu/data:=/mavros/imu/data"``. ``body_frame``: axes of the IMU messages, ``"flu"`` (REP-103) or ``"frd"``.

    Raises InputError where the aircraft file, a topic's name or ``body_frame`` is wrong.
    """
    if not isinstance(path, str | Path):
        raise InputError(f"path {path!r:.80}: expected the path of one bag or log; load each flight by itself")
    if body_frame not in BODY_FRAMES:
        raise InputError(f"body_frame = {body_frame!r}: expected one of {', '.join(BODY_FRAMES)}")
    known = aircraft if isinstance(aircraft, Aircraft) else load_aircraft(aircraft)
    return FlightFile(Path(path), known, topic_names(topics), body_frame)


def flight_list(given: FlightFile | Iterable[FlightFile], called: str) -> list[FlightFile]:
    """One flight or several as a list; ``called`` is the argument's name. Raises InputError for what is no flight."""
    flights = list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    for flight in flights:
        if not isinstance(flight, FlightFile):
            raise InputError(f"{called}: got {flight!r:.80}, expected what load(path, aircraft) returns")
    return flights


def refuse_other_aircraft(flights: Sequence[FlightFile]) -> None:
    """Raise InputError where two flights were loaded with different aircraft files, of which one alone would count."""
    first = flights[0]
    for flight in flights[1:]:
        if flight.aircraft != first.aircraft:
            raise InputError(
                f"flights {first.name} and {flight.name} were loaded with different aircraft files "
                f"({first.aircraft.name} and {flight.aircraft.name}); load all with one"
            )


def read_alike(
    flights: Sequence[FlightFile],
    carried: str,
    read: Callable[[FlightFile, str], T],
    is_commanded: Callable[[T], bool],
) -> list[T]:
    """What ``read(flight, carried)`` gives of the flights of one recorder.

    Whether the actuators' messages are commands is told from the messages where ``carried`` is "auto". Smooth inputs do
    not tell it. A flight that does not is read as the others are, where one of them is known to hold commands.
    """
    found = [read(flight, carried) for flight in flights]
    if carried != "auto" or not any(map(is_commanded, found)):
        return found
    pairs = zip(found, flights, strict=True)
    return [one if is_commanded(one) else read(flight, "commands") for one, flight in pairs]
