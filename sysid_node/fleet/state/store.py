"""The state file of a fleet: what came of each flight, in one SQLite file, each flight in a transaction of its own.

SQLite's rollback journal with full synchronisation keeps every committed flight through a kill of the command, a loss
of power and a full disk (sqlite.org/atomiccommit.html). One process writes: the command, which holds the folder's lock.
"""

from __future__ import annotations

import datetime
import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.errors import InputError
from sysid_node.fleet.outcome import FlightOutcome
from sysid_node.interruption import indivisible

STATE = "fleet.sqlite"
#: The state file and what SQLite keeps beside it while it writes.
FILES = (STATE, f"{STATE}-journal")

_VERSION = 1
_SCHEMA = """
CREATE TABLE IF NOT EXISTS flights (
    flight TEXT PRIMARY KEY, fingerprint TEXT NOT NULL, status TEXT NOT NULL, reason TEXT NOT NULL,
    aircraft TEXT NOT NULL, vehicle TEXT NOT NULL, date TEXT, seconds REAL, names TEXT, valid BLOB, estimates BLOB,
    covariance BLOB, statistical BLOB, gap TEXT, report TEXT, remarks TEXT NOT NULL, took REAL, finished TEXT NOT NULL
);
CREATE TABLE IF NOT EXISTS inputs (path TEXT PRIMARY KEY, stamp TEXT NOT NULL, hash TEXT NOT NULL);
"""

#: What came of a flight: estimates, a refusal for a reason that lies in the flight, or an attempt that was lost.
DONE, REFUSED, LOST = "done", "refused", "lost"


@dataclass(frozen=True)
class FlightEntry:
    """A flight in the state file: its ``outcome`` where it has one, else the ``reason`` in one line."""

    flight: str
    fingerprint: str
    status: str
    reason: str
    outcome: FlightOutcome | None
    gap: StoredDocument | None
    report: str | None
    remarks: tuple[str, ...]
    took: float  # s


class StoredDocument(Mapping[str, Any]):
    """A JSON document of the state file as a mapping; it is read when it is looked at, and not kept in memory."""

    def __init__(self, path: Path, flight: str) -> None:
        self._path, self._flight = path, flight

    def _content(self) -> dict[str, Any]:
        connection = _opened_to_read(self._path)
        try:
            row = connection.execute("SELECT gap FROM flights WHERE flight = ?", (self._flight,)).fetchone()
        finally:
            connection.close()
        return dict(json.loads(row[0]))

    def __getitem__(self, key: str) -> Any:
        return self._content()[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._content())

    def __len__(self) -> int:
        return len(self._content())


class FleetState:
    """The state file of a fleet's folder. Every call raises InputError where the file cannot be read or written.

    ``read_only``: nothing is written; hashes that are to be remembered are not.
    """

    def __init__(self, path: Path, *, read_only: bool = False) -> None:
        self.path, self._read_only = path, read_only
        self._hashes: dict[tuple[str, str], str] = {}  # of inputs, by path and stamp; not written yet
        with self._errors():
            self._connection = _opened_to_read(path) if read_only else sqlite3.connect(path)
            self._connection.execute("PRAGMA synchronous = FULL")
            version = self._connection.execute("PRAGMA user_version").fetchone()[0]
            if version not in (0, _VERSION):
                raise InputError(f"{path}: of another version of the program; give another folder as --out")
            if read_only:
                return
            with self._transaction():
                self._connection.executescript(_SCHEMA)
                self._connection.execute(f"PRAGMA user_version = {_VERSION}")

    def close(self) -> None:
        """Close the file."""
        with self._errors():
            if self._hashes:
                with self._transaction():
                    self._write_hashes()
            self._connection.close()

    def fingerprints(self) -> dict[str, str]:
        """The fingerprint of every flight that is finished, which a lost one is not."""
        with self._errors():
            rows = self._connection.execute("SELECT flight, fingerprint FROM flights WHERE status != ?", (LOST,))
            return dict(rows.fetchall())

    def known_hash(self, path: str, stamp: str) -> str | None:
        """The hash of an input that has had this stamp; None where it is not known."""
        if (path, stamp) in self._hashes:
            return self._hashes[path, stamp]
        with self._errors():
            row = self._connection.execute("SELECT hash FROM inputs WHERE path = ? AND stamp = ?", (path, stamp))
            found = row.fetchone()
        return None if found is None else str(found[0])

    def remember_hash(self, path: str, stamp: str, digest: str) -> None:
        """Keep the hash of an input for as long as its stamp stays; it is written with what is next kept."""
        if not self._read_only:
            self._hashes[path, stamp] = digest

    def keep(
        self,
        flight: str,
        fingerprint: str,
        outcome: FlightOutcome,
        *,
        report: str | None,
        remarks: tuple[str, ...] = (),
        took: float = 0.0,
    ) -> None:
        """Keep a flight's outcome, in place of an earlier one; it is on the disk when this returns."""
        covariance, statistical = (_packed(m) for m in (outcome.covariance, outcome.statistical_covariance))
        estimates = np.asarray(outcome.values, "<f8").tobytes()
        gap = None if outcome.gap is None else json.dumps(outcome.gap)
        date = None if outcome.date is None else outcome.date.isoformat()
        row = (flight, fingerprint, DONE, "", outcome.aircraft, outcome.vehicle, date, outcome.data_seconds)
        valid = np.asarray(outcome.valid, np.uint8).tobytes()
        more = (json.dumps(outcome.names), valid, estimates, covariance, statistical, gap, report)
        self._replace((*row, *more, json.dumps(remarks), took, _now()))

    def refuse(
        self, flight: str, fingerprint: str, reason: str, *, aircraft: str, lost: bool, took: float = 0.0
    ) -> None:
        """Keep why a flight has no outcome; one that was ``lost`` is tried again at the next start."""
        row = (flight, fingerprint, LOST if lost else REFUSED, reason, aircraft, "")
        self._replace((*row, *(None,) * 9, "[]", took, _now()))

    def _replace(self, row: tuple[object, ...]) -> None:
        with self._errors(), self._transaction():
            self._write_hashes()
            self._connection.execute(f"REPLACE INTO flights VALUES ({', '.join('?' * len(row))})", row)

    def _write_hashes(self) -> None:
        rows = [(path, stamp, digest) for (path, stamp), digest in self._hashes.items()]
        self._connection.executemany("REPLACE INTO inputs VALUES (?, ?, ?)", rows)
        self._hashes.clear()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """A transaction that a signal does not interrupt, so that no journal is left beside the file."""
        with indivisible(), self._connection:
            yield

    def entries(self) -> Iterator[FlightEntry]:
        """Every flight in the file, one at a time."""
        with self._errors():
            for row in self._connection.execute("SELECT * FROM flights ORDER BY flight"):
                yield self._entry(row)

    def _entry(self, row: tuple[Any, ...]) -> FlightEntry:
        flight, key, status, reason, aircraft, vehicle, date, seconds, names, valid, estimates, *rest = row
        covariance, statistical, gap, report, remarks, took, _ = rest
        when = None if date is None else datetime.datetime.fromisoformat(date)
        document = None if gap is None else StoredDocument(self.path, flight)
        outcome = None
        if status == DONE:
            n = len(json.loads(names))
            outcome = FlightOutcome(
                aircraft=aircraft,
                vehicle=vehicle,
                date=when,
                data_seconds=seconds,
                names=tuple(json.loads(names)),
                values=np.frombuffer(estimates, "<f8"),
                covariance=_unpacked(covariance, n),
                statistical_covariance=_unpacked(statistical, n),
                valid=np.frombuffer(valid, np.uint8).astype(bool),
            )
        told = tuple(json.loads(remarks))
        return FlightEntry(flight, key, status, reason, outcome, document, report, told, took)

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """Turns an error of SQLite into an InputError of one line."""
        try:
            yield
        except sqlite3.DatabaseError as error:
            full = "full" in str(error) or "disk I/O" in str(error)
            remedy = "make room and start again; what was finished is kept" if full else "move it away and start again"
            raise InputError(f"{self.path}: cannot be read or written: {error}; {remedy}") from error


def _opened_to_read(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)


def _packed(matrix: np.typing.NDArray[np.float64]) -> bytes:
    """The lower triangle of a symmetric matrix (n, n), by rows."""
    return np.asarray(matrix, "<f8")[np.tril_indices(len(matrix))].tobytes()


def _unpacked(triangle: bytes, n: int) -> np.typing.NDArray[np.float64]:
    """The symmetric matrix (n, n) of a lower triangle."""
    matrix = np.zeros((n, n))
    matrix[np.tril_indices(n)] = np.frombuffer(triangle, "<f8")
    return matrix + np.tril(matrix, -1).T


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
