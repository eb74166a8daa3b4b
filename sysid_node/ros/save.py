"""Writes estimates where they outlive the node, with the keys of ``summary.json``."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sysid_node.errors import InputError
from sysid_node.ros.session import Session


def save_estimates(folder: Path, session: Session) -> Path:
    """Write ``<aircraft>-<stamp of the last sample>.json`` into ``folder``, whole or not at all. NaN becomes null.

    Returns the file. Raises InputError where the folder cannot be written.
    """
    stamp_ns, estimates, _ = session.now()
    content = {
        "aircraft": session.aircraft.name,
        "method": session.settings.method,
        "stamp_ns": stamp_ns,
        "data_seconds": estimates.time,
        "samples": session.samples,
        "rejected": session.rejected,
        "settings": session.settings.as_dict(),
        "derivatives": {name: _plain(d._asdict(), without="name") for name, d in estimates.derivatives.items()},
        "fits": {name: _plain(f._asdict(), without="coefficient") for name, f in estimates.fits.items()},
        "holdout": {},
    }
    path = folder / f"{session.aircraft.name}-{stamp_ns}.json"
    partial = path.with_suffix(".part")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        partial.write_text(json.dumps(_plain(content), indent=2, allow_nan=False) + "\n", encoding="utf-8")
        partial.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); set the parameter save_directory") from None
    return path


def _plain(values: Mapping[str, Any], without: str = "") -> dict[str, Any]:
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in values.items()
        if key != without
    }
