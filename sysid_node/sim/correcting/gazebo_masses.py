"""Mass, centre of gravity and inertia of a Gazebo model changed in the link that carries its aerodynamics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.correcting.xml_editing import text_element
from sysid_node.sim.importing.gazebo.sdf import SdfLink, SdfModel, masses, read_sdf

Array = NDArray[np.float64]


def change_masses(
    root: Element, path: Path, plugin: Element, before: Aircraft, after: Aircraft, shift: Mapping[str, float]
) -> None:
    """Change the link, in place, so that the whole model has the changes; ``shift`` is of the centre of gravity, m.

    Raises InputError where the link has no inertial.
    """
    same = before.mass == after.mass and vars(before.inertia) == vars(after.inertia) and not any(shift.values())
    if same:
        return
    name = (plugin.findtext("link_name") or "").strip()
    inertial = root.find(f".//link[@name='{name}']/inertial")
    if inertial is None:
        raise InputError(f"--model {path}: the link {name!r} has no <inertial>; complete it")
    model = read_sdf(path)
    mass, centre, inertia = masses(model)
    own = model.links[name]
    wanted_mass = mass + after.mass - before.mass
    wanted_centre = centre + np.array([shift["x"], -shift["y"], -shift["z"]])
    own_mass = own.mass + after.mass - before.mass
    if not own_mass > 0.0:
        raise InputError(f"--model {path}: the link {name!r} has {own.mass:g} kg, too little for the change; change it")
    own_centre = (wanted_mass * wanted_centre - (mass * centre - own.mass * own.centre)) / own_mass
    moved = _with(model, name, replace(own, mass=own_mass, centre=own_centre))
    missing = inertia + _tensor(after) - _tensor(before) - masses(moved)[2]
    turn = own.pose.axes.as_matrix()
    _write(inertial, own_mass, turn.T @ (own_centre - own.pose.place), turn.T @ (own.inertia + missing) @ turn)


def _with(model: SdfModel, name: str, link: SdfLink) -> SdfModel:
    return replace(model, links={**model.links, name: link})


def _tensor(aircraft: Aircraft) -> Array:
    """The inertia forward-left-up, where the xz entry is the usual Ixz itself."""
    i = aircraft.inertia
    return np.array([[i.Ixx, 0.0, i.Ixz], [0.0, i.Iyy, 0.0], [i.Ixz, 0.0, i.Izz]])


def _write(inertial: Element, mass: float, place: Array, tensor: Array) -> None:
    """The inertial in its link's axes, without a rotation of its own."""
    _set(inertial, "pose", " ".join(f"{x:.12g}" for x in [*place.tolist(), 0.0, 0.0, 0.0]))
    _set(inertial, "mass", f"{mass:.12g}")
    entries = inertial.find("inertia")
    if entries is None:
        entries = text_element(inertial, "inertia", "")
    for i, j, tag in ((0, 0, "ixx"), (0, 1, "ixy"), (0, 2, "ixz"), (1, 1, "iyy"), (1, 2, "iyz"), (2, 2, "izz")):
        _set(entries, tag, f"{float(tensor[i, j]):.12g}")


def _set(parent: Element, tag: str, text: str) -> None:
    element = parent.find(tag)
    if element is None:
        text_element(parent, tag, text)
    else:
        element.text = text
