"""Finished steps of a diagnosis, kept in a folder so that one that was interrupted goes on where it stopped.

Each file is named after a digest of all that its content depends on: flights, aircraft, effects and where the fit
started. A file of another diagnosis is never taken for one of this.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sysid_node.gap.estimation.fit import CandidateFit, converged, linearised
from sysid_node.gap.residuals.residual_model import ResidualModel


@dataclass(frozen=True)
class Checkpoint:
    """A folder of finished steps, or None to keep nothing; ``digest`` tells the flights and the aircraft."""

    folder: Path | None = None
    digest: str = ""
    done: dict[str, CandidateFit] = field(default_factory=dict)  # what was fitted in this run

    @classmethod
    def of(cls, folder: Path | None, models: Sequence[ResidualModel]) -> Checkpoint:
        """Those of these flights."""
        text = hashlib.sha256(repr(models[0].simulator.aircraft).encode())
        for model in models:
            text.update(np.ascontiguousarray(model.series).tobytes())
            text.update(np.ascontiguousarray(model.commands).tobytes())
        return cls(folder, text.hexdigest())

    def polished(self, fit: CandidateFit) -> CandidateFit:
        """The fit polished, or as it was when this was done before."""
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
        """Numbers by these names that were worked out about a fit, or as they were before."""
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

    def forget(self) -> None:
        """Removes the files of this diagnosis, which is finished, and the folder where nothing else is in it."""
        if self.folder is None or not self.folder.is_dir():
            return
        for path in self.folder.glob(f"{self.digest[:12]}-*"):
            path.unlink()
        if not any(self.folder.iterdir()):
            self.folder.rmdir()

    def _key(self, kind: str, fit: CandidateFit) -> str:
        key = hashlib.sha256((self.digest + kind + "+".join(c.label for c in fit.candidates)).encode())
        for array in (*fit.points, *fit.power, fit.nuisances.sigma):
            key.update(np.ascontiguousarray(array).tobytes())
        return key.hexdigest()

    def _path(self, key: str, suffix: str) -> Path | None:
        if self.folder is None:
            return None
        self.folder.mkdir(parents=True, exist_ok=True)
        return self.folder / f"{self.digest[:12]}-{key[:24]}.{suffix}"


def _restored(path: Path, fit: CandidateFit) -> CandidateFit:
    with np.load(path) as kept:
        points, power = (tuple(kept[f"{kind}{i}"] for i in range(len(fit.models))) for kind in ("point", "power"))
    return linearised(replace(fit, points=points, power=power))


def _store(path: Path, fit: CandidateFit) -> None:
    kinds = {"point": fit.points, "power": fit.power}
    arrays = {f"{kind}{i}": array for kind, of in kinds.items() for i, array in enumerate(of)}
    partial = path.with_suffix(".part.npz")
    np.savez(partial, **arrays)  # type: ignore[arg-type]  # NumPy's stubs take the names for options
    partial.replace(path)
