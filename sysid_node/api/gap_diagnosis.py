"""Flights held against the simulator: where they differ, and which effect causes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from sysid_node.aircraft.model import Aircraft, Derivative
from sysid_node.api.compiled_programs import release_compiled_programs
from sysid_node.api.data_frames import data_frame
from sysid_node.api.flight_file import FlightFile, flight_list, read_alike, refuse_other_aircraft
from sysid_node.errors import InputError, noted_warnings
from sysid_node.flight.commanded import CARRIED
from sysid_node.gap.correction import corrected_aircraft
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.diagnose import diagnose as diagnose_flights
from sysid_node.gap.document import document
from sysid_node.gap.flightdata.gap_flight import GapFlight, load_gap_flights, longest
from sysid_node.gap.flightdata.opposite_readings import check_directions
from sysid_node.gap.reflying import InSimulator, fly_in, reflown_content
from sysid_node.report.drawing.plotly_figure import plotly_figure
from sysid_node.report.files.gap_folder import UNFINISHED, write_gap
from sysid_node.report.files.outputs.output_folder import output_folder
from sysid_node.report.files.runs.run_folder import REPORT
from sysid_node.report.sections.gap.flight import flight_figures
from sysid_node.report.sections.gap.paragraph import paragraph
from sysid_node.report.sections.gap.waterfall import waterfall
from sysid_node.sim.correcting.user_simulator import user_simulator

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


@dataclass(frozen=True, repr=False)
class GapDiagnosis:
    """A diagnosis with its verdict, causes and size. ``diagnosis`` holds all that the program found."""

    diagnosis: Diagnosis
    flown: InSimulator | None = None  # what the correction does in the user's simulator
    warnings: tuple[str, ...] = ()  # about the flights, as they were given

    @property
    def verdict(self) -> str:
        """``"no_gap"``, ``"explained"``, ``"ambiguous"``, ``"unknown_effect"`` or ``"unsupported"``."""
        return self.diagnosis.verdict

    @property
    def words(self) -> str:
        """What was found, in one paragraph."""
        return paragraph(self.diagnosis)

    @cached_property
    def document(self) -> dict[str, Any]:
        """The content of ``gap.json``."""
        there = {} if self.flown is None else {"reflown": reflown_content(self.flown)}
        return {**document(self.diagnosis), **there}

    @property
    def causes(self) -> list[dict[str, Any]]:
        """Each cause with its effect, parameters (value, standard error) and probability."""
        return list(self.document["causes"])

    @property
    def derivatives(self) -> dict[str, Derivative]:
        """The aircraft file's derivatives as the flights have them, within their tolerances."""
        return dict(corrected_aircraft(self.diagnosis).derivatives)

    def plot(self, what: str = "where") -> Figure:
        """A Plotly figure as the report draws it: ``"where"`` the gap lies, or the ``"flight"`` beside the simulator.

        Raises InputError for any other word.
        """
        if what == "where":
            return plotly_figure([("Where the gap lies", waterfall(self.diagnosis))], columns=1)
        if what == "flight":
            return plotly_figure(flight_figures(self.diagnosis), columns=2)
        raise InputError(f"plot {what!r}: expected 'where' or 'flight'")

    def to_pandas(self) -> Any:
        """The candidates with probability and share. Raises ImportError where pandas is not installed."""
        rows = self.document["candidates"]
        columns = {name: [row[name] for row in rows] for name in ("probability", "share")}
        return data_frame(columns, index=[row["effect"] for row in rows], index_name="effect")

    def write(self, folder: Path) -> None:
        """Write what ``sysid gap`` writes into a folder that holds nothing else. Raises InputError."""
        write_gap(folder, self.diagnosis, self.flown, self.warnings)

    def save(self, folder: str | Path, *, force: bool = False) -> Path:
        """Write what ``sysid gap`` writes; returns the path of the report.

        Raises InputError where the folder holds anything but an earlier diagnosis and ``force`` is not given, or cannot
        be written.
        """
        with output_folder(folder, "gap", force=force, working=[UNFINISHED]) as out:
            out.publish(self.write)
        return Path(folder) / REPORT

    def __repr__(self) -> str:
        return f"{self.verdict}: {self.words}"

    def _repr_html_(self) -> str:
        return str(Markup("<p><strong>{}</strong></p><p>{}</p>").format(self.verdict.replace("_", " "), self.words))


def diagnose(
    flights: FlightFile | Sequence[FlightFile],
    *,
    holdout: FlightFile | Sequence[FlightFile] = (),
    simulator: str | None = None,
    simulated: FlightFile | Sequence[FlightFile] = (),
    actuators: str = "auto",
    resume: str | Path | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> GapDiagnosis:
    """Finds where the simulator of the aircraft file and the flights differ, and which effect causes it.

    The gap is measured on ``holdout``; without it, on parts of the flights that were not fitted. ``simulated`` are
    flights recorded in a simulator of any kind: it is identified from them, the aircraft file being a first guess, and
    the flights are held against it instead. ``resume``: a folder for finished steps, from which an interrupted
    diagnosis goes on. ``progress`` is called with the share done (0..1) and what is being done. A diagnosis takes about
    a minute for a minute of flight. ``simulator``: ``jsbsim:NAME`` or
    ``jsbsim:FILE``, a model of the same aircraft; the correction is written into a copy of it, and both fly there.
    ``actuators``: what the actuators' messages are, "commands", "positions", or "auto": told from those of all flights.

    Raises InputError where ``actuators`` is no such word, the aircraft file has no tolerances, a flight cannot be read,
    is fitted and held out at once, shows no motion, or a surface that is counted the other way than in the file; where
    the simulator's model cannot be read or is another aircraft's; and where the simulated flights do not suffice.
    """
    flights, held, of_simulation = (
        flight_list(given, called)
        for given, called in ((flights, "flights"), (holdout, "holdout"), (simulated, "simulated"))
    )
    if not flights:
        raise InputError("no flight to diagnose; give at least one")
    refuse_other_aircraft([*flights, *held, *of_simulation])
    if simulator is not None and of_simulation:
        raise InputError("simulator and simulated: both are given; give the model, or flights recorded in it")
    if actuators not in CARRIED:
        raise InputError(f"actuators = {actuators!r}: expected one of {', '.join(CARRIED)}")
    aircraft = flights[0].aircraft
    theirs = None if simulator is None else user_simulator(simulator, aircraft)
    noted: list[str] = []
    with noted_warnings(noted):
        real, of_simulator = (
            read_alike(
                group,
                actuators,
                lambda f, carried: _checked(
                    aircraft, load_gap_flights(f.path, aircraft, f.topics, f.body_frame, carried)
                ),
                lambda parts: parts[0].record.commanded,
            )
            for group in ([*flights, *held], of_simulation)
        )
    fitted, held_out = _all_parts(real[: len(flights)]), _all_parts(real[len(flights) :])
    keep = None if resume is None else Path(resume)
    release_compiled_programs()
    report = progress or (lambda share, doing: None)
    found = diagnose_flights(aircraft, fitted, held_out, report, keep=keep, simulated=_all_parts(of_simulator))
    if theirs is None:
        return GapDiagnosis(found, warnings=tuple(noted))
    report(0.99, f"the held-out commands in {theirs.label}")
    return GapDiagnosis(found, fly_in(theirs, found), tuple(noted))


def _all_parts(flights: Sequence[list[GapFlight]]) -> list[GapFlight]:
    """The parts of all flights."""
    return list(chain.from_iterable(flights))


def _checked(aircraft: Aircraft, parts: list[GapFlight]) -> list[GapFlight]:
    """The parts of a flight, once it is known which way its surfaces are counted."""
    check_directions(aircraft, longest(parts))
    return parts
