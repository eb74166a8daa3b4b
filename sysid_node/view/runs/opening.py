"""Tells what a path is, and makes its scene."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sysid_node.errors import InputError
from sysid_node.view.bodies import aircraft_for
from sysid_node.view.scene import Scene


def scene_of(path: Path, aircraft: str | None) -> Scene:
    """The scene of a folder that a command wrote. Raises InputError where it is none that can be shown.

    ``aircraft``: an aircraft file or a name; by default the run's own, where it is one that is shipped.
    """
    kind, content = kind_of(path)
    if kind == "manoeuvre":
        raise InputError(
            f"{path}: is a designed manoeuvre; show its predicted flight: {path / 'flight'} with --aircraft FILE|NAME"
        )
    chosen = aircraft_for(aircraft, content.get("aircraft", ""))
    if kind == "gap":
        from sysid_node.view.runs.gap_run import scene_of_gap  # noqa: PLC0415

        return scene_of_gap(path, content, chosen)
    if kind == "loop":
        from sysid_node.view.runs.loop_run import scene_of_loop  # noqa: PLC0415

        return scene_of_loop(path, content, chosen)
    from sysid_node.view.runs.estimator_run import scene_of_run  # noqa: PLC0415

    return scene_of_run(path, chosen)


def run_folder(path: Path) -> Path | None:
    """The folder with the result of a command that a path stands for, or None where it is none.

    A flight of a fleet that was diagnosed and has no report of its own is its diagnosis. Raises InputError for the
    folder of a whole fleet.
    """
    if (path / "fleet.json").is_file():
        raise InputError(f"{path}: is a whole fleet; give the folder of one flight, in {path / 'flights'}")
    for folder in (path, path / "gap"):
        if (folder / "gap.json").is_file() or (folder / "summary.json").is_file():
            return folder
    return None


def kind_of(folder: Path) -> tuple[str, dict[str, Any]]:
    """``"gap"``, ``"loop"``, ``"manoeuvre"`` or ``"run"``, and the content of its JSON file. Raises InputError."""
    name = "gap.json" if (folder / "gap.json").is_file() else "summary.json"
    try:
        content = json.loads((folder / name).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{folder / name}: cannot be read ({error}); run the command that wrote it again") from None
    if not isinstance(content, dict):
        raise InputError(f"{folder / name}: expected a JSON object; run the command that wrote it again")
    if name == "gap.json":
        return "gap", content
    if "tracking_error" in content:
        return "loop", content
    return ("manoeuvre" if "manoeuvre" in content else "run"), content
