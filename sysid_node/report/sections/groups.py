"""Derivatives grouped as the equations of motion are: longitudinal, lateral-directional, and the rest."""

from __future__ import annotations

from collections.abc import Iterable

from sysid_node.aircraft.names import COEFFICIENTS, LATERAL, LONGITUDINAL
from sysid_node.report.wording.names import split_name

GROUPS = (("Longitudinal", LONGITUDINAL), ("Lateral and directional", LATERAL), ("Other parameters", ("",)))
_ORDER = {coefficient: i for i, coefficient in enumerate(COEFFICIENTS)}


def grouped(names: Iterable[str]) -> list[tuple[str, list[str]]]:
    """Titles and names, by coefficient within a group, otherwise in the order given; empty groups left out."""
    listed = sorted(names, key=lambda name: _ORDER.get(split_name(name)[0], len(_ORDER)))
    groups = [(title, [n for n in listed if split_name(n)[0] in members]) for title, members in GROUPS]
    return [(title, members) for title, members in groups if members]
