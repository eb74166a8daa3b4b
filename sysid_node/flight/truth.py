"""The truth beside a simulated bag: ``BAG.truth.json``, kept apart so that nothing that reads the bag sees it."""

from __future__ import annotations

import json
from pathlib import Path

from sysid_node.errors import InputError


def truth_path(bag: str | Path) -> Path:
    """The truth file of a bag, whether it is given as its folder or as a file in it."""
    bag = Path(bag).resolve()
    folder = bag if bag.is_dir() or not bag.suffix else bag.parent
    return folder.with_name(f"{folder.name}.truth.json")


def read_truth(bag: str | Path) -> dict[str, float]:
    """True derivatives by name; empty where there is no truth file. Raises InputError where it is no such file."""
    path = truth_path(bag)
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return {str(name): float(value) for name, value in found["derivatives"].items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: expected JSON with derivatives: {{name: value}}, got {error}; remove it") from error
