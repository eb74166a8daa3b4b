"""The flights of a fleet, its maintenance notes, and what is wrong with which entry."""

from __future__ import annotations

import datetime
import hashlib
import re
from dataclasses import dataclass

from sysid_node.fleet.results import MaintenanceNote

#: What a name of a folder keeps of a flight's name.
_PLAIN = re.compile(r"[^\w.-]+")


@dataclass(frozen=True)
class CatalogueFlight:
    """A flight of the catalogue. ``flight`` is its name, unique; ``location`` a path, or an address for fsspec.

    ``aircraft`` is a file or a name. Where ``tail`` is empty or ``date`` None the log says them; ``fallback_tail`` is
    the tail where it does not. ``fault``: what is wrong with the entry, in one line; empty for nothing.
    """

    flight: str
    location: str
    aircraft: str
    tail: str = ""
    fallback_tail: str = ""
    configuration: str = ""
    date: datetime.datetime | None = None
    fault: str = ""

    @property
    def folder(self) -> str:
        """The name of the folder of its own report: the flight's name, with a hash where that is no name of a file."""
        plain = _PLAIN.sub("_", self.flight).strip("._")[:80]
        if plain == self.flight:
            return plain
        return f"{plain}-{hashlib.sha256(self.flight.encode()).hexdigest()[:8]}".lstrip("-")


@dataclass(frozen=True)
class Catalogue:
    """All flights, by unique names, and the maintenance notes."""

    flights: tuple[CatalogueFlight, ...]
    maintenance: tuple[MaintenanceNote, ...] = ()
