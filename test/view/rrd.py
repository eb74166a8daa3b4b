"""Reads an ``.rrd`` file back: which entities it holds, on which time lines, and with which values."""

import warnings
from pathlib import Path

import numpy as np
import pytest

rerun_chunk = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed (requirements/view.txt)")


class Recorded:
    """``values``: (entity, component) -> times (N,) s, None where static, and values (N, ...) or a list of texts."""

    def __init__(self, path: Path) -> None:
        self.values: dict[tuple[str, str], tuple[np.ndarray | None, list]] = {}
        self.timelines: set[str] = set()
        reader = rerun_chunk.RrdReader(path)
        self.applications = {entry.application_id for entry in reader.recordings()}
        self.blueprints = len(reader.blueprints())
        for chunk in reader.stream():
            self._take(chunk)

    def _take(self, chunk) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            batch = chunk.to_record_batch()
        self.timelines |= set(chunk.timeline_names)
        time = None
        if not chunk.is_static and "flight" in chunk.timeline_names:
            time = batch.column("flight").cast("int64").to_numpy() / 1e9
        for field in batch.schema:
            metadata = {k.decode(): v.decode() for k, v in (field.metadata or {}).items()}
            if metadata.get("rerun:kind") != "data":
                continue
            rows = batch.column(field.name).to_pylist()
            key = (chunk.entity_path, metadata["rerun:component"].partition(":")[2])
            before, known = self.values.get(key, (None, []))
            joined = time if before is None or time is None else np.concatenate([before, time])
            self.values[key] = (joined, [*known, *rows])

    @property
    def entities(self) -> set[str]:
        """Every entity with data of its own."""
        return {entity for entity, _ in self.values if not entity.startswith("/__")}

    def curve(self, entity: str) -> tuple[np.ndarray, np.ndarray]:
        """Times (N,) s and values (N,) of a curve, by time."""
        time, rows = self.values[entity, "scalars"]
        order = np.argsort(time, kind="stable")
        return time[order], np.array([np.nan if row[0] is None else row[0] for row in rows])[order]

    def vectors(self, entity: str, component: str) -> tuple[np.ndarray, np.ndarray]:
        """Times (N,) s and vectors (N, K) of a component."""
        time, rows = self.values[entity, component]
        moving = [row[0] for row in rows if row]
        return time, np.array(moving[-len(time) :], dtype=float)

    def texts(self, entity: str, component: str) -> list[str]:
        """Texts of a component, in the order in which they were logged."""
        return [row[0] for row in self.values[entity, component][1] if row]
