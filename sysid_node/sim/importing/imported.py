"""What an import gives."""

from __future__ import annotations

from dataclasses import dataclass

from sysid_node.aircraft.model import Aircraft


@dataclass(frozen=True)
class Imported:
    """The aircraft, and in whole sentences what of the model an aircraft file cannot hold."""

    aircraft: Aircraft
    notes: tuple[str, ...] = ()


#: Ixy and Iyz below this share of the largest moment of inertia are not worth a word.
_SYMMETRIC = 1e-3


def asymmetry_notes(share: float) -> list[str]:
    """What is said of the larger of |Ixy| and |Iyz|, as a share of the largest moment of inertia."""
    if share <= _SYMMETRIC:
        return []
    return [f"Ixy or Iyz is {share:.1%} of the largest moment of inertia; a file has Ixz only."]
