"""Finished steps of a diagnosis, kept in a folder so that an interrupted diagnosis goes on where it stopped.

Each file is named after a digest of all that its content depends on: the version of the package, flights, aircraft,
candidates and the start of the fit. So a file of one diagnosis is never taken for a file of another. The files are JSON
and arrays of numbers, which hold no code; one that is damaged or was cut short is computed again.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO
from zipfile import BadZipFile

import numpy as np

from sysid_node.errors import InputError
from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.version import VERSION


@dataclass(frozen=True)
class Checkpoint:
    """The finished steps of one diagnosis: in memory, and in a folder where one is given."""

    folder: Path | None = None
    digest: str = ""  # of the flights and the aircraft
    done: dict[str, CandidateFit] = field(default_factory=dict)  # fits of this run

    @classmethod
    def of(cls, folder: Path | None, models: Sequence[ResidualModel]) -> Checkpoint:
        """The checkpoint of a diagnosis of these flights."""
        text = hashlib.sha256(f"{VERSION} {models[0].simulator.aircraft!r}".encode())
        for model in models:
            text.update(np.ascontiguousarray(model.series).tobytes())
            text.update(np.ascontiguousarray(model.commands).tobytes())
        return cls(folder, text.hexdigest())

    def converged(self, fit: CandidateFit) -> CandidateFit:
        """The converged fit, computed or restored."""
        key = self._key("fit", fit)
        if key not in self.done:
            path = self._path(key, "npz")
            kept = _restored(path, fit) if path is not None else None
            self.done[key] = kept or converged(fit)
            if path is not None and kept is None:
                _store(path, self.done[key])
        return self.done[key]

    def table(
        self, fit: CandidateFit, names: Sequence[str], work: Callable[[], dict[str, list[float]]]
    ) -> dict[str, list[float]]:
        """Numbers by these names that ``work`` computes for a fit, computed or restored."""
        path = self._path(self._key("+".join(["table", *names]), fit), "json")
        if path is None:
            return work()
        kept = _restored_table(path)
        if kept is not None:
            return kept
        done = work()
        _write_whole(path, lambda file: file.write(json.dumps(done).encode()))
        return done

    def clear(self) -> None:
        """Removes the files of this diagnosis, and the folder if nothing else is in it."""
        if self.folder is None or not self.folder.is_dir():
            return
        for path in self.folder.glob(f"{self.digest[:12]}-*"):
            path.unlink()
        if not any(self.folder.iterdir()):
            self.folder.rmdir()

    def _key(self, kind: str, fit: CandidateFit) -> str:
        key = hashlib.sha256((self.digest + kind + "+".join(c.label for c in fit.candidates)).encode())
        points, powers = ([getattr(flight, name) for flight in fit.flights] for name in ("point", "power"))
        for array in (*points, *powers, fit.nuisances.sigma):
            key.update(np.ascontiguousarray(array).tobytes())
        return key.hexdigest()

    def _path(self, key: str, suffix: str) -> Path | None:
        if self.folder is None:
            return None
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be made ({error.strerror}); give another folder") from error
        return self.folder / f"{self.digest[:12]}-{key[:24]}.{suffix}"


def _restored(path: Path, fit: CandidateFit) -> CandidateFit | None:
    """The fit with the kept points and powers; None where there is no such file, or it is damaged."""
    flights = []
    try:
        with np.load(path, allow_pickle=False) as kept:
            for number, flight in enumerate(fit.flights):
                point, power = kept[f"point{number}"], kept[f"power{number}"]
                if any(
                    new.shape != np.shape(old) or new.dtype != np.float64 or not np.isfinite(new).all()
                    for new, old in ((point, flight.point), (power, flight.power))
                ):
                    return None
                flights.append(replace(flight, point=point, power=power))
    except (OSError, EOFError, KeyError, ValueError, BadZipFile, zlib.error):
        return None
    return linearised(replace(fit, flights=tuple(flights)))


def _restored_table(path: Path) -> dict[str, list[float]] | None:
    """The kept numbers by name; None where there is no such file, or it is damaged."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(kept, dict) or not all(isinstance(row, list) for row in kept.values()):
        return None
    return {name: [float(value) for value in row] for name, row in kept.items()}


def _store(path: Path, fit: CandidateFit) -> None:
    arrays = {f"point{number}": flight.point for number, flight in enumerate(fit.flights)}
    arrays |= {f"power{number}": flight.power for number, flight in enumerate(fit.flights)}
    _write_whole(path, lambda file: np.savez(file, **arrays))  # type: ignore[arg-type]  # taken for options


def _write_whole(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a file aside and move it into place. Raises InputError where that cannot be done."""
    partial = path.with_suffix(".part")
    try:
        with partial.open("wb") as file:
            write(file)
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise InputError(f"{path.parent}: cannot be written ({error.strerror}); give another folder") from error
