"""Names of what a recording holds: the time line, and the entities of aircraft, curves and lanes."""

from __future__ import annotations

import re

#: The time line of all data, and the name under which the viewer lists our recordings.
TIMELINE, APPLICATION = "flight", "sysid"

#: Where entities of each kind stand.
WORLD, LANES, NOTES, ABOUT = "world", "lanes", "notes", "about"


def part(name: str) -> str:
    """A name as a part of an entity's path: lower case, with underscores for what is neither letter nor digit."""
    return re.sub(r"[^0-9a-zA-Z]+", "_", name).strip("_").lower() or "_"


def curve_path(tab: str, panel: str, curve: str) -> str:
    """The entity of a curve. Derivatives keep their names, as in ``/derivatives/Cm_alpha/estimate``."""
    return f"{part(tab)}/{panel if re.fullmatch(r'[A-Za-z]+_[A-Za-z0-9_]+', panel) else part(panel)}/{part(curve)}"


def place_path(body: str) -> str:
    """The entity of an aircraft's place: its attitude is of the entity ``body`` below it."""
    return f"{WORLD}/{part(body)}"


def lane_path(lane: str) -> str:
    """The entity of a lane."""
    return f"{LANES}/{part(lane)}"
