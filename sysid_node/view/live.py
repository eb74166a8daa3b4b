"""A flight that goes on: turns what came in since the last look into what is added to the screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.live.news import FlightNews
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.online.types import Estimates
from sysid_node.report.results.run_result import References, prior_of
from sysid_node.view.bodies import body_of_record, shape_of_aircraft
from sysid_node.view.panels import MOVING_SHARE, SURFACES, derivative_tabs, estimate_notes, motion_panels
from sysid_node.view.scene import NOTHING, PALE, VERMILION, Body, Lane, LaneChange, Note, PlotPanel, Scene

_IMU = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi")
_AIR = ("V", "alpha", "beta", "rho")

#: Seconds of controls that are looked at to see whether one moves, and the least deflection that counts, rad.
_LOOK_BACK, _LEAST = 1.0, 0.01

#: Regressors -> the manoeuvre that excites them.
_EXCITED_BY = {
    "alpha": "elevator", "q": "elevator", "de": "elevator", "p": "aileron", "da": "aileron",
    "beta": "rudder", "r": "rudder", "dr": "rudder",
}  # fmt: skip
#: How the statuses begin that a movement of the surfaces ends.
_MOTION_HELPS = ("converging", "not excited", "collinear with")


class LiveScene:
    """``declared`` holds all that will be shown, without data; ``update`` returns what is new."""

    def __init__(self, aircraft: Aircraft) -> None:
        self._aircraft, self._actuation = aircraft, Actuation.of(aircraft)
        self._references = References(prior_of(aircraft))
        self._last: tuple[float, Mapping[str, float]] | None = None  # the newest sample: its time, and values by column
        self._place = np.zeros(3)  # m
        self._controls: dict[str, tuple[Array, Array]] = {}  # times and values of the last seconds
        self._states: dict[str, str] = {}  # of lanes
        self._newest: Estimates | None = None
        self._range: dict[str, tuple[float, float]] = {}

    @property
    def declared(self) -> Scene:
        """The panels, lanes and the aircraft; no data."""
        none = np.zeros(0)
        unknown = Estimates(0.0, {}, {})
        record = FlightRecord(
            np.array([0.0, 1.0]),
            {name: np.zeros(2) for name in (*_IMU, *_AIR, "thrust", *self._aircraft.control_symbols)},
        )
        tabs = {**self._derivatives([unknown]), "Flight": [_emptied(p) for p in motion_panels(record)]}
        body = Body("measured", PALE, none, np.zeros((0, 3)), np.zeros((0, 4)))
        lanes = [Lane(SURFACES.get(s, s), [LaneChange(0.0, "moves")]) for s in self._aircraft.control_symbols]
        return Scene(
            f"{self._aircraft.name}, live", self.words(unknown), shape_of_aircraft(self._aircraft), [body], tabs, lanes,
            [Note(0.0, "listening")],
        )  # fmt: skip

    def update(
        self, start_ns: int, news: FlightNews, estimates: Sequence[Estimates], faults: Mapping[str, str]
    ) -> Scene:
        """The new part of curves, lanes and notes; ``about`` holds the newest words on what to fly next."""
        record = self._record(start_ns, news)
        notes = estimate_notes([*([self._newest] if self._newest else []), *estimates])
        seen = {name for name, d in (self._newest.derivatives if self._newest else {}).items() if d.valid}
        if self._newest:
            notes = [n for n in notes if n.time > self._newest.time and not _again(n, seen)]
        self._newest = estimates[-1] if estimates else self._newest
        now = float(record.time[-1]) if record else estimates[-1].time if estimates else 0.0
        tabs = self._derivatives(estimates) if estimates else {}
        if record is not None:
            tabs["Flight"] = motion_panels(record)
        return Scene(
            title="",
            about=self.words(self._newest or Estimates(0.0, {}, {})),
            shape=shape_of_aircraft(self._aircraft),
            bodies=[self._body(record)] if record is not None else [],
            tabs=tabs,
            lanes=[*self._moves(record), *self._failures(now, faults)],
            notes=notes,
        )

    def words(self, estimates: Estimates) -> str:
        """How many derivatives are valid, what is not excited, and what to fly next, as Markdown."""
        known = estimates.derivatives
        if not known:
            return f"# {self._aircraft.name}, live\n\nNo estimate has come yet."
        valid = sum(d.valid for d in known.values())
        lines = [f"# {valid} of {len(known)} valid after {estimates.time:.0f} s"]
        wanting = [n for n, d in known.items() if not d.valid]
        moved = [n for n in wanting if known[n].status.startswith(_MOTION_HELPS)]
        missing = {
            control: [n for n in moved if _EXCITED_BY.get(n.partition("_")[2]) == control]
            for control in dict.fromkeys(_EXCITED_BY.values())
        }
        if any(d.status == "stale input" for d in known.values()):
            return "\n\n".join([*lines, "A sensor sends no data (stale input)."])
        for control, names in sorted(missing.items(), key=lambda pair: -len(pair[1])):
            if names:
                lines.append(f"**Move the {control}**: {', '.join(f'{n} ({known[n].status})' for n in names)}.")
        others = [f"{n} ({known[n].status})" for n in wanting if n not in moved]
        if others:
            lines.append(f"**Manoeuvres do not help**: {', '.join(others)}.")
        return "\n\n".join(lines if len(lines) > 1 else [*lines, "Nothing that a control excites is missing."])

    def _derivatives(self, estimates: Sequence[Estimates]) -> dict[str, list[PlotPanel]]:
        names = self._aircraft.derivatives
        return derivative_tabs(estimates, self._references, names)

    def _record(self, start_ns: int, news: FlightNews) -> FlightRecord | None:
        """The new IMU samples with the others at their times, the newest earlier sample before them."""
        if not news.imu:
            return None
        time = np.array([(stamp - start_ns) / 1e9 for stamp, _ in news.imu])
        columns = dict(zip(_IMU, np.array([values for _, values in news.imu]).T, strict=True))
        last, actuation = self._last, self._actuation
        columns |= _interpolated(time, start_ns, _AIR, news.air, last)
        rows = [(at, actuation.of_message(actuation.places(tuple(j)), tuple(j.values()))) for at, j in news.joints]
        accepted = [(stamp, values) for stamp, values in rows if not isinstance(values, str)]
        columns |= _interpolated(time, start_ns, ("thrust", *self._aircraft.control_symbols), accepted, last)
        if last is not None:
            keep = time > last[0]
            time = np.append(last[0], time[keep])
            columns = {n: np.append(last[1][n], values[keep]) for n, values in columns.items()}
        newest = np.maximum.accumulate(np.append(-np.inf, time))[:-1]
        later = time > newest  # messages may arrive out of order
        time, columns = time[later], {n: values[later] for n, values in columns.items()}
        if time.size:
            self._last = float(time[-1]), {n: float(values[-1]) for n, values in columns.items()}
        return (
            FlightRecord(time, columns) if time.size > 1 else None
        )  # one sample is no motion; the next call adds to it

    def _body(self, record: FlightRecord) -> Body:
        """The aircraft from where it was seen last; its way is not drawn as a line, as it is not over."""
        body = body_of_record(record, "measured", PALE, path=False)
        position = body.position + self._place
        self._place = position[-1]
        return replace(body, position=position)

    def _moves(self, record: FlightRecord | None) -> list[Lane]:
        """Which control begins or ends to move."""
        lanes: list[Lane] = []
        if record is None:
            return lanes
        for symbol in self._aircraft.control_symbols:
            time, values = self._controls.get(symbol, (np.zeros(0), np.zeros(0)))
            new = record.time > (time[-1] if time.size else -np.inf)
            time, values = np.append(time, record.time[new]), np.append(values, record[symbol][new])
            kept = time > record.time[-1] - _LOOK_BACK
            self._controls[symbol] = time[kept], values[kept]
            low, high = self._range.get(symbol, (np.inf, -np.inf))
            self._range[symbol] = low, high = min(low, *values[kept]), max(high, *values[kept])
            moves = np.ptp(values[kept]) > max(MOVING_SHARE * (high - low), _LEAST)
            lanes += self._changed(SURFACES.get(symbol, symbol), record.time[-1], "moves" if moves else NOTHING)
        return lanes

    def _failures(self, now: float, faults: Mapping[str, str]) -> list[Lane]:
        """Which part is reported as failed, or no longer."""
        lanes = [
            lane for part, text in faults.items() for lane in self._changed(f"fault: {part}", now, text, VERMILION)
        ]
        over = [n for n, s in self._states.items() if n.startswith("fault: ") and s != NOTHING and n[7:] not in faults]
        return [*lanes, *(lane for name in over for lane in self._changed(name, now, NOTHING, VERMILION))]

    def _changed(self, name: str, time: float, state: str, colour: tuple[int, int, int] | None = None) -> list[Lane]:
        if self._states.get(name, "") == state:
            return []
        self._states[name] = state
        lane = Lane(name, [LaneChange(float(time), state)])
        return [lane if colour is None else replace(lane, colour=colour)]


def _again(note: Note, seen: set[str]) -> bool:
    """Whether a note says of a derivative that was valid before that it is."""
    name, _, rest = note.text.partition(" ")
    return rest.startswith("valid") and name in seen


def _emptied(panel: PlotPanel) -> PlotPanel:
    none = np.zeros(0)
    return replace(panel, curves=[replace(curve, time=none, values=none) for curve in panel.curves])


def _interpolated(
    time: Array,
    start_ns: int,
    names: Sequence[str],
    messages: Sequence[tuple[int, tuple[float, ...]]],
    last: tuple[float, Mapping[str, float]] | None,
) -> dict[str, Array]:
    """Messages' values at times (N,), interpolated; without a message the last known values, or NaN."""
    if not messages:
        return {n: np.full(time.shape, last[1][n] if last is not None else np.nan) for n in names}
    messages = sorted(messages, key=lambda message: message[0])
    at = np.array([(stamp - start_ns) / 1e9 for stamp, _ in messages])
    table = np.array([values for _, values in messages], dtype=float)
    return {name: np.interp(time, at, table[:, k]) for k, name in enumerate(names)}
