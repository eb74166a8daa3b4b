"""What an import gives."""

from __future__ import annotations

from dataclasses import dataclass

from sysid_node.aircraft.model import Aircraft


@dataclass(frozen=True)
class Imported:
    """The aircraft, and in whole sentences what of the model an aircraft file cannot hold."""

    aircraft: Aircraft
    notes: tuple[str, ...] = ()
