"""True derivatives of a simulated bag, in ``BAG.truth.json`` beside it, so that readers of the bag do not see them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

from sysid_node.errors import InputError


def truth_path(bag: str | Path) -> Path:
    """The truth file of a bag, which is given as its folder or as a file in it."""
    bag = Path(bag).resolve()
    folder = bag if bag.is_dir() or not bag.suffix else bag.parent
    return folder.with_name(f"{folder.name}.truth.json")


class Truth(NamedTuple):
    """True derivatives by name at the end of a flight, and since when (s) those that changed have their value."""

    values: dict[str, float]
    since: dict[str, float]


def read_truth(bag: str | Path) -> dict[str, float]:
    """The true derivatives that are constant during the whole flight."""
    truth = truth_at_end(bag)
    return {name: value for name, value in truth.values.items() if name not in truth.since}


def truth_at_end(bag: str | Path) -> Truth:
    """The true derivatives at the end; empty where there is no truth file. Raises InputError where it is malformed."""
    path = truth_path(bag)
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        truth = Truth(_numbers(found["derivatives"]), {})
        for change in found.get("changes", []):
            changed = _numbers(change["derivatives"])
            truth.values.update(changed)
            truth.since.update(dict.fromkeys(changed, float(change["time"])))
        return truth
    except FileNotFoundError:
        return Truth({}, {})
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: expected JSON with derivatives: {{name: value}}, got {error}; remove it") from error


def _numbers(values: dict[str, float]) -> dict[str, float]:
    return {str(name): float(value) for name, value in values.items()}
