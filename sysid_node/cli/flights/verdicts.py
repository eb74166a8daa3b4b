"""Which command takes a flight: told from its survey, or by the commands' own readers where the aircraft is known."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import joined_spans, stamp_spans, why_nothing_aligned
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.live.interruptions import Interruptions
from sysid_node.flight.logs.checks.survey import FULL_DEFLECTION, OUTPUTS, LogSurvey
from sysid_node.flight.logs.opening import carried_by, load_flight_record
from sysid_node.flight.pieces import flight_pieces
from sysid_node.online.alignment.flight_checks import FlightChecks
from sysid_node.online.alignment.in_pieces import PieceAlignment
from sysid_node.online.settings import FIRST_ESTIMATE, OnlineSettings, too_short_to_replay

#: The shortest flight that ``sysid gap`` diagnoses, s (``gap.flightdata.gap_flight``, which takes long to load).
SHORTEST_FOR_GAP = 6.0

#: In less flight, s, no equation of five unknowns is determined below 3 Hz (``batch.regression.effective_length``).
SHORTEST_TO_IDENTIFY = 1.0

_KEYS = {
    OUTPUTS: "outputs (which output moves which joint)",
    FULL_DEFLECTION: "full_deflection of each control",
}

_ANGLES = {"alpha": "the angle of attack", "beta": "the sideslip"}

#: Methods of ``sysid identify`` that integrate a model; the others regress on measured flow angles
#: (``batch.identify``, which takes long to load).
_WITHOUT_VANES = ("output_error", "filter_error", "*_kalman_filter")

_Topics = Mapping[str, str] | None
Refusals = Mapping[str, str]  # command -> why it does not take the flight; empty where it does


def refusals_told(found: LogSurvey) -> dict[str, str]:
    """What the commands will refuse, as far as the flight's file alone tells."""
    always = found.refusal.text or found.sparse
    whole = always or found.two_clocks
    short = "" if found.uninterrupted >= SHORTEST_FOR_GAP else _too_short(found.uninterrupted)
    lacks = f"no complete {', '.join(found.gap_lacks)}; the gap cannot be measured without" if found.gap_lacks else ""
    gap = whole or lacks or short
    told = f"{found.seconds:.2g} s of flight; give a longer flight"
    replay = always or found.incomplete or (told if found.seconds < FIRST_ESTIMATE else "")
    identify = whole or found.incomplete or (told if found.seconds < SHORTEST_TO_IDENTIFY else "")
    return {"replay": replay, "identify": identify, "gap": gap, "faults": replay}


def _too_short(seconds: float) -> str:
    return f"{seconds:.1f} s of flight without an interruption; the gap needs {SHORTEST_FOR_GAP:g} s or more"


def refusals_tried(
    path: Path, aircraft: Aircraft, topics: Mapping[str, str] | None = None, frame: BodyFrame = "flu"
) -> dict[str, str]:
    """What the commands refuse for an aircraft: each one's own reader is asked.

    ``topics`` and ``frame`` are for bags of our own topics, as of ``open_streams``.
    """
    replay = _refusal(path, lambda: _replayed(path, aircraft, topics, frame))
    return {
        "replay": replay,
        "identify": _refusal(path, lambda: _identified(path, aircraft, topics, frame)),
        "gap": _refusal(path, lambda: _diagnosed(path, aircraft, topics, frame)),
        "faults": replay,
    }


def _refusal(path: Path, read: Callable[[], object]) -> str:
    """Why a reader refuses the flight, without the file's name; empty where it does not."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)  # the survey has told them, but for these
        for told in (".*mean (specific force|lift|airspeed)", ".*interruptions of up to", ".*no change for"):
            warnings.filterwarnings("always", told, InputWarning)
        try:
            read()
        except InputError as error:
            text = str(error)
            text = text.partition(": ")[2] if text.startswith("flight '") else text
            for name in (f"{path}: ", f"bag {path.name}: ", f"{path.name}: ", f"{path.stem}: "):
                text = text.removeprefix(name)
            return text
        except ModuleNotFoundError as error:  # as the command itself, which needs more packages than this one
            return f"needs the package {error.name}, which is not installed; run: pip install -r requirements/desk.txt"
        except Exception as error:  # as the command itself, whose fault must not hide the rest of the table
            return f"fails with {type(error).__name__}: {' '.join(str(error).split())}"
    return ""


def _replayed(path: Path, aircraft: Aircraft, topics: _Topics, frame: BodyFrame) -> None:
    """Read a flight as ``sysid replay`` does. Raises InputError where there are no samples."""
    max_gap, setting = OnlineSettings().max_gap, OnlineSettings().actuators
    with flight_pieces(path, aircraft, topics, frame) as flight:
        alignment = None
        spans: dict[str, tuple[float, float]] = {}
        names: tuple[str, ...] = ()
        checks, interruptions = FlightChecks(aircraft), Interruptions()
        began = last = math.nan
        for piece in flight.pieces:
            names, spans = piece.streams.actuators.names, joined_spans(spans, stamp_spans(piece.streams))
            alignment = alignment or PieceAlignment(aircraft, max_gap, carried_by(piece.streams, setting))
            aligned = alignment.take(piece.streams, last=piece.last)
            if aligned.time.size:
                interruptions.add_samples(last, aligned.time, max_gap)
                began, last = float(aligned.time[0]) if math.isnan(began) else began, float(aligned.time[-1])
            checks.add(aligned, piece.streams.imu)
        if not math.isnan(last):
            checks.check(flight.name)
            if last - began < FIRST_ESTIMATE:
                raise InputError(too_short_to_replay(flight.name, last - began))
            if broken := interruptions.fault(last, max_gap):
                warnings.warn(f"{flight.name}: {broken}", InputWarning, stacklevel=2)
            return
        Actuation.of(aircraft).require(names, flight.name)
        raise InputError(why_nothing_aligned(flight.name, spans, alignment.rejected if alignment else {}))


def _identified(path: Path, aircraft: Aircraft, topics: _Topics, frame: BodyFrame) -> None:
    """Read a flight as ``sysid identify`` does. Flow angles need not be measured, as not all methods need them."""
    from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom  # noqa: PLC0415  # JAX
    from sysid_node.batch.regression.measured_coefficients import measured_coefficients  # noqa: PLC0415  # JAX
    from sysid_node.batch.settings import DEFAULT_LOW_PASS  # noqa: PLC0415  # JAX

    record = load_flight_record(path, aircraft, topics=topics, frame=frame, carried="auto")
    unmeasured = {name: np.zeros(len(record)) for name in _ANGLES if not record.measured(name)}
    found = measured_coefficients(aircraft, replace(record, columns={**record.columns, **unmeasured}))
    for coefficient, regressors in aircraft.model_structure.items():
        if coefficient in found.coefficients:
            names = [f"{coefficient}_{name}" for name in regressors]
            effective_degrees_of_freedom(names, [found.time], DEFAULT_LOW_PASS)


def _diagnosed(path: Path, aircraft: Aircraft, topics: _Topics, frame: BodyFrame) -> None:
    from sysid_node.gap.flightdata.gap_flight import load_gap_flights, longest  # noqa: PLC0415  # JAX takes its time
    from sysid_node.gap.flightdata.opposite_readings import check_directions  # noqa: PLC0415  # JAX

    check_directions(aircraft, longest(load_gap_flights(path, aircraft, topics, frame)))


def verdicts(found: LogSurvey, refused: Refusals, *, aircraft_known: bool) -> dict[str, str]:
    """By commands, whether they take the flight and how; those with the same verdict are together."""
    needs = "" if aircraft_known else " and ".join(_KEYS[key] for key in found.needs)
    where = f", where the aircraft file states {needs}" if needs else ""
    how = f"yes{where}, {_flow_angles(found.angles)}"
    taken = {"replay": how, "identify": how, "gap": how, "faults": _faults(found)}
    if len(found.angles) < 2:
        taken["identify"] = f"yes{where}, by {', '.join(_WITHOUT_VANES)}; the other methods need both flow angles"
    texts = {command: f"no: {why}" if why else taken[command] for command, why in refused.items()}
    together: dict[str, list[str]] = {}
    for command, text in texts.items():
        together.setdefault(text, []).append(command)
    return {", ".join(commands): text for text, commands in together.items()}


def _flow_angles(measured: tuple[str, ...]) -> str:
    missing = [words for name, words in _ANGLES.items() if name not in measured]
    if len(missing) == len(_ANGLES):
        return "without vanes: the angle of attack and the sideslip are inferred"
    return f"with one vane: {missing[0]} is inferred" if missing else "with vanes"


def _faults(found: LogSurvey) -> str:
    learning = FaultMonitorSettings().learning
    if found.seconds <= learning:
        return f"no: {found.seconds:.1f} s; more than {learning:g} s are needed to learn what sound flight is like"
    return "yes" if found.angles else "yes, of surfaces and of the airframe; not of vanes"
