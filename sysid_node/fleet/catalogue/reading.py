"""Reads a catalogue: a CSV or a YAML file, or a folder of logs.

An entry whose path is a pattern stands for all flights that it matches. What is wrong with one entry is its fault and
does not stop the others; what is wrong with the catalogue itself raises InputError.
"""

from __future__ import annotations

import csv
import datetime
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from sysid_node.errors import InputError
from sysid_node.fleet.catalogue import locations
from sysid_node.fleet.catalogue.catalogue import Catalogue, CatalogueFlight
from sysid_node.fleet.results import MaintenanceNote
from sysid_node.flight.logs.content import Content, content_of
from sysid_node.suggestion import did_you_mean

#: The keys of an entry.
KEYS = ("path", "flight", "aircraft", "tail", "configuration", "date", "maintenance")
#: Files of a folder that are no flights.
_SKIPPED = frozenset({".yaml", ".yml", ".json", ".html", ".md", ".txt", ".png", ".svg", ".sqlite", ".parquet"})
AIRCRAFT_FILE = "aircraft.yaml"


@dataclass(frozen=True)
class _Row:
    """An entry as it was written; ``where`` says at which place of the catalogue."""

    where: str
    values: Mapping[str, str]

    def __getitem__(self, key: str) -> str:
        return self.values.get(key, "").strip()


def read_catalogue(path: str | Path, aircraft: str | None = None) -> Catalogue:
    """The flights of a catalogue. ``aircraft``: of entries that name none. Raises InputError."""
    path = Path(path)
    if path.is_dir():
        return _unique(Catalogue(tuple(_flights_of_folder(path, aircraft))))
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        words = getattr(error, "strerror", None) or "is no text"
        raise InputError(f"catalogue {path}: cannot be read: {words}; give a CSV or a YAML file, or a folder") from None
    rows, default = _yaml_rows(path, text) if _is_yaml(path, text) else (_csv_rows(path, text), "")
    found = list(rows)
    if not found:
        raise InputError(f"catalogue {path}: has no flights; give a line for each")
    path = path.absolute()
    base = path.parent
    notes = [_note(row, base) for row in found if row["maintenance"]]
    flights = [flight for row in found if row["path"] for flight in _flights(row, path, aircraft or default)]
    return _unique(Catalogue(tuple(flights), tuple(sorted(notes, key=lambda note: (note.tail, note.date)))))


def _is_yaml(path: Path, text: str) -> bool:
    return path.suffix.lower() in {".yaml", ".yml"} or (path.suffix.lower() != ".csv" and "flights:" in text)


def _csv_rows(path: Path, text: str) -> Iterator[_Row]:
    """The entries of a table whose columns are separated by commas, or by semicolons as some spreadsheets write it."""
    first = next(iter(text.splitlines()), "")
    lines = csv.reader(text.splitlines(), delimiter=";" if ";" in first and "," not in first else ",")
    header = [name.strip().lower() for name in next(lines, [])]
    if "path" not in header and {"t", "ax", "az"} <= set(header):
        raise InputError(f"catalogue {path}: is a flight itself; give its folder, or a catalogue that names it")
    _check_keys(header, f"catalogue {path}, line 1")
    if twice := [name for name, count in Counter(header).items() if count > 1]:
        raise InputError(f"catalogue {path}, line 1: column {twice[0]!r} is there twice; keep one")
    if "path" not in header:
        raise InputError(f"catalogue {path}: line 1: column 'path' is missing; its columns may be {', '.join(KEYS)}")
    for number, cells in enumerate(lines, start=2):
        where = f"catalogue {path}, line {number}"
        if not any(cell.strip() for cell in cells) or cells[0].lstrip().startswith("#"):
            continue
        if len(cells) > len(header):
            raise InputError(f"{where}: has {len(cells)} cells for {len(header)} columns; quote a cell with a comma")
        yield _checked(_Row(where, dict(zip(header, cells, strict=False))))


def _yaml_rows(path: Path, text: str) -> tuple[Iterable[_Row], str]:
    try:
        content = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:  # ValueError: a date like 2026-13-45
        raise InputError(f"catalogue {path}: is no YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict) or not isinstance(content.get("flights"), list):
        raise InputError(f"catalogue {path}: expected a key 'flights' with a list")
    allowed = ("aircraft", "flights", "maintenance")
    for key in content:
        if key not in allowed:
            raise InputError(f"catalogue {path}: unknown key {key!r}; expected {', '.join(allowed)}")
    rows = [_yaml_row(f"catalogue {path}, flights[{i}]", entry) for i, entry in enumerate(content["flights"])]
    for i, entry in enumerate(content.get("maintenance") or []):
        where = f"catalogue {path}, maintenance[{i}]"
        if not isinstance(entry, dict) or set(entry) - {"aircraft"} != {"tail", "date", "text"}:
            raise InputError(f"{where}: expected the keys tail, date, text, and perhaps aircraft")
        values = {"maintenance" if key == "text" else key: _text(value) for key, value in entry.items()}
        rows.append(_checked(_Row(where, values)))
    return rows, _text(content.get("aircraft"))


def _yaml_row(where: str, entry: Any) -> _Row:
    if isinstance(entry, str):
        entry = {"path": entry}
    if not isinstance(entry, dict):
        raise InputError(f"{where}: expected a path, or keys such as path and tail; got {entry!r}")
    _check_keys(entry, where)
    return _checked(_Row(where, {key: _text(value) for key, value in entry.items()}))


def _text(value: Any) -> str:
    if isinstance(value, datetime.date):
        return value.isoformat()
    return "" if value is None else str(value)


def _check_keys(keys: Iterable[str], where: str) -> None:
    for key in keys:
        if key not in KEYS:
            hint = did_you_mean(str(key), KEYS)
            raise InputError(f"{where}: unknown key {key!r}{hint}; expected {', '.join(KEYS)}")


def _checked(row: _Row) -> _Row:
    if not row["path"] and not row["maintenance"]:
        raise InputError(f"{row.where}: names neither a path nor a maintenance; give one")
    if row["maintenance"] and not (row["tail"] and row["date"]):
        raise InputError(f"{row.where}: a maintenance needs a tail and a date")
    return row


def _note(row: _Row, base: Path) -> MaintenanceNote:
    aircraft = _aircraft_path(row["aircraft"], base) if row["aircraft"] else ""
    try:
        return MaintenanceNote(row["tail"], date_of(row["date"]), row["maintenance"], aircraft)
    except ValueError as error:
        raise InputError(f"{row.where}: {error}") from None


def date_of(text: str) -> datetime.datetime:
    """A date in UTC: ISO 8601, with a time or without, of UTC where it names no zone. Raises ValueError."""
    try:
        found = datetime.datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(f"date {text!r}: expected YYYY-MM-DD, or with a time, as in 2026-05-03T09:30:00Z") from None
    return found.astimezone(datetime.UTC) if found.tzinfo else found.replace(tzinfo=datetime.UTC)


def _flights(row: _Row, catalogue: Path, aircraft: str) -> Iterator[CatalogueFlight]:
    """The flights that an entry of the ``catalogue`` stands for."""
    given, base = row["aircraft"], catalogue.parent
    chosen = _aircraft_path(given, base) if given else aircraft
    entry = CatalogueFlight("", row["path"], chosen, row["tail"], "", row["configuration"])
    try:
        entry = replace(entry, date=date_of(row["date"]) if row["date"] else None)
        found = _of_pattern(row["path"], locations.expanded(row["path"], base), catalogue)
    except ValueError as error:
        yield replace(entry, flight=row["flight"] or row["path"], fault=f"{row.where}: {error}")
        return
    if not found:
        fault = f"{row.where}: nothing matches {row['path']}; mend the pattern"
        yield replace(entry, flight=row["flight"] or row["path"], fault=fault)
    for location in found:
        name = row["flight"] or _short(location, base)
        fault = "" if chosen else f"{row.where}: names no aircraft; add a column 'aircraft', or give --aircraft"
        if row["flight"] and len(found) > 1:
            name = f"{row['flight']}/{_short(location, base)}"
        yield replace(entry, flight=name, location=location, fault=fault or _fault_at(location))


def _of_pattern(pattern: str, found: list[str], catalogue: Path) -> list[str]:
    """What a pattern matches, without the catalogue, other files that are no flights, files of bags, and folders."""
    if found == [pattern] or not locations.has_marks(pattern):
        return found
    bags = {path for path in found if not locations.is_remote(path) and (Path(path) / "metadata.yaml").is_file()}
    kept = [path for path in found if path != str(catalogue) and not bags.intersection(map(str, Path(path).parents))]
    flights = [path for path in kept if path in bags or Path(path).suffix.lower() not in _SKIPPED]
    folders = {str(folder) for path in flights for folder in Path(path).parents}
    return [path for path in flights if path not in folders]


def _aircraft_path(given: str, base: Path) -> str:
    """A file's path, which a catalogue states relative to itself; a name stays a name."""
    isfile = given.endswith((".yaml", ".yml")) or os.sep in given
    return str(base / Path(given).expanduser()) if isfile else given


def _short(location: str, base: Path) -> str:
    """A flight's name: its location, relative to the catalogue where it lies beneath it."""
    if locations.is_remote(location):
        return location
    path = Path(location)
    return path.relative_to(base).as_posix() if path.is_relative_to(base) else path.as_posix()


def _fault_at(location: str) -> str:
    try:
        if not locations.exists(location):
            return f"{location}: does not exist"
        if not locations.is_remote(location):
            content_of(location)
    except InputError as error:
        return str(error)
    return ""


def _flights_of_folder(folder: Path, aircraft: str | None) -> Iterator[CatalogueFlight]:
    """All logs beneath a folder, the aircraft of each by ``aircraft.yaml`` beside it or in a folder above."""
    base = folder.absolute()
    for path in _logs(base):
        own = next((p / AIRCRAFT_FILE for p in _above(path, base) if (p / AIRCRAFT_FILE).is_file()), None)
        chosen = str(own) if own is not None else aircraft or ""
        tail = path.parent.name if path.parent != base else ""
        where = f"no {AIRCRAFT_FILE} in its folder or above; write one, or give --aircraft"
        fault = "" if chosen else f"{path}: {where}"
        yield CatalogueFlight(_short(str(path), base), str(path), chosen, fallback_tail=tail, fault=fault)


def _above(path: Path, base: Path) -> Iterator[Path]:
    """The folders from that of a path up to ``base``."""
    for parent in path.parents:
        yield parent
        if parent == base:
            return


def _logs(folder: Path) -> Iterator[Path]:
    """Flights beneath a folder, told by content; a folder with metadata.yaml is a bag and is not looked into."""
    for item in sorted(folder.iterdir()):
        if item.name.startswith("."):
            continue
        if item.is_dir():
            if (item / "metadata.yaml").is_file():
                yield item
            else:
                yield from _logs(item)
        elif item.suffix.lower() not in _SKIPPED and _is_flight(item):
            yield item


def _is_flight(path: Path) -> bool:
    try:
        return content_of(path) in Content
    except InputError:
        return False


def _unique(found: Catalogue) -> Catalogue:
    """The catalogue, with a fault for each entry whose name another has."""
    counts = Counter(flight.flight for flight in found.flights)
    flights, seen = [], Counter[str]()
    for flight in found.flights:
        seen[flight.flight] += 1
        if counts[flight.flight] == 1:
            flights.append(flight)
            continue
        name = f"{flight.flight}#{seen[flight.flight]}"
        fault = flight.fault
        if seen[flight.flight] > 1:
            fault = fault or f"{flight.flight}: is in the catalogue {counts[flight.flight]} times; keep one"
        flights.append(replace(flight, flight=flight.flight if seen[flight.flight] == 1 else name, fault=fault))
    if not flights:
        raise InputError("the catalogue names no flights")
    return replace(found, flights=tuple(flights))
