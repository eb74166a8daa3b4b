"""Finished steps of a diagnosis, kept in a folder so that an interrupted diagnosis goes on where it stopped.

Each file is named after a digest of all that its content depends on: flights, aircraft, candidates and the start of the
fit. So a file of one diagnosis is never taken for a file of another.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.residuals.residual_model import ResidualModel


@dataclass(frozen=True)
class Checkpoint:
    """The finished steps of one diagnosis: in memory, and in a folder where one is given."""

    folder: Path | None = None
    digest: str = ""  # of the flights and the aircraft
    done: dict[str, CandidateFit] = field(default_factory=dict)  # fits of this run

    @classmethod
    def of(cls, folder: Path | None, models: Sequence[ResidualModel]) -> Checkpoint:
        """The checkpoint of a diagnosis of these flights."""
        text = hashlib.sha256(repr(models[0].simulator.aircraft).encode())
        for model in models:
            text.update(np.ascontiguousarray(model.series).tobytes())
            text.update(np.ascontiguousarray(model.commands).tobytes())
        return cls(folder, text.hexdigest())

    def converged(self, fit: CandidateFit) -> CandidateFit:
        """The converged fit, computed or restored."""
        key = self._key("fit", fit)
        if key not in self.done:
            path = self._path(key, "npz")
            if path is not None and path.exists():
                self.done[key] = _restored(path, fit)
            else:
                self.done[key] = converged(fit)
                if path is not None:
                    _store(path, self.done[key])
        return self.done[key]

    def table(
        self, fit: CandidateFit, names: Sequence[str], work: Callable[[], dict[str, list[float]]]
    ) -> dict[str, list[float]]:
        """Numbers by these names that ``work`` computes for a fit, computed or restored."""
        path = self._path(self._key("+".join(["table", *names]), fit), "json")
        if path is None:
            return work()
        if path.exists():
            kept: dict[str, list[float]] = json.loads(path.read_text(encoding="utf-8"))
            return kept
        done = work()
        partial = path.with_suffix(".part")
        partial.write_text(json.dumps(done), encoding="utf-8")
        partial.replace(path)
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
        self.folder.mkdir(parents=True, exist_ok=True)
        return self.folder / f"{self.digest[:12]}-{key[:24]}.{suffix}"


def _restored(path: Path, fit: CandidateFit) -> CandidateFit:
    with np.load(path) as kept:
        flights = [
            replace(flight, point=kept[f"point{number}"], power=kept[f"power{number}"])
            for number, flight in enumerate(fit.flights)
        ]
    return linearised(replace(fit, flights=tuple(flights)))


def _store(path: Path, fit: CandidateFit) -> None:
    arrays = {f"point{number}": flight.point for number, flight in enumerate(fit.flights)}
    arrays |= {f"power{number}": flight.power for number, flight in enumerate(fit.flights)}
    partial = path.with_suffix(".part.npz")
    np.savez(partial, **arrays)  # type: ignore[arg-type]  # NumPy's stubs take the names for options
    partial.replace(path)
