"""Saves estimates to a file during the flight, with the keys of ``summary.json``."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sysid_node.errors import InputError
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates
from sysid_node.user_path import user_path


def save_estimates(
    folder: Path,
    estimates: Estimates,
    *,
    node: str,
    aircraft: str,
    settings: OnlineSettings,
    stamp_ns: int,
    samples: int,
    rejected: Mapping[str, int],
) -> Path:
    """Write ``<aircraft>-<stamp_ns>.json`` into ``folder``, completely or not at all, and return its absolute path.

    ``node`` is the estimator's full name. Its namespace, where it has one, begins the file's name, so that aircraft of
    one type that fly together keep their files apart (``uav1-cdrw-<stamp_ns>.json`` of ``/uav1/identifier``).

    A ``~`` at the beginning of ``folder`` is the user's home: no shell expands it in a parameter.
    Characters of the aircraft's name that could lead out of the folder become underscores in the file's name.

    ``stamp_ns`` is the header stamp of the last sample, ``samples`` the number of all samples, ``rejected`` the number
    of messages left out by reason. NaN becomes null. Raises InputError where the folder cannot be written.
    """
    content = {
        "node": node,
        "aircraft": aircraft,
        "method": settings.method,
        "stamp_ns": stamp_ns,
        "data_seconds": estimates.time,
        "samples": samples,
        "rejected": rejected,
        "settings": settings.as_dict(),
        **_findings(estimates),
    }
    folder = user_path(folder).absolute()
    name = "-".join([*node.strip("/").split("/")[:-1], aircraft])
    path = folder / f"{_file_name(name)}-{stamp_ns}.json"
    partial = path.with_suffix(".part")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        partial.write_text(json.dumps(_plain(content), indent=2, allow_nan=False) + "\n", encoding="utf-8")
        partial.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); set the parameter save_directory") from None
    return path


def _findings(estimates: Estimates) -> dict[str, object]:
    """What was estimated, as ``summary.json`` has it."""
    return {
        "derivatives": {name: _plain(d._asdict(), without="name") for name, d in estimates.derivatives.items()},
        "fits": {name: _plain(f._asdict(), without="coefficient") for name, f in estimates.fits.items()},
        "servos": {name: _plain(d._asdict(), without="name") for name, d in estimates.servos.items()},
        "budget": {name: dict(shares) for name, shares in estimates.budget.items()},
        "holdout": {},
    }


def _file_name(name: str) -> str:
    """A name as the beginning of a file's name, at most 100 characters."""
    return re.sub(r"[^\w.+ -]", "_", name)[:100].lstrip(". ") or "aircraft"


def _plain(values: Mapping[str, Any], without: str = "") -> dict[str, Any]:
    """The values as JSON has them: null where one is not finite; ``without`` one key."""
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in values.items()
        if key != without
    }
