"""A model's links, joints, masses and plugins, from its SDF. Gazebo's axes are forward-left-up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.errors import InputError
from sysid_node.sim.importing.gazebo.frames import SdfFrames, SdfPose, pose_of
from sysid_node.sim.importing.gazebo.numbers import number, number_in
from sysid_node.sim.importing.xml_document import parse_xml

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SdfLink:
    """A link: its pose, mass (kg), centre of mass (3,) m and inertia (3, 3) kg m^2 about it, in the model's axes."""

    pose: SdfPose
    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class SdfModel:
    """A model of an SDF file."""

    file: str
    name: str
    links: dict[str, SdfLink]
    joints: dict[str, Element]
    plugins: tuple[Element, ...]
    includes: tuple[str, ...]

    def plugins_named(self, *names: str) -> list[Element]:
        """The plugins whose class has one of these names, whatever its namespace."""
        return [p for p in self.plugins if (p.get("name") or "").rpartition("::")[2] in names]

    def joint_number(self, joint: str, path: str) -> float | None:
        """A number of a joint; None where it is absent or without limit."""
        element = self.joints[joint].find(path) if joint in self.joints else None
        if element is None:
            return None
        value = number(element, self.file)
        return value if abs(value) < 1e10 else None


def read_sdf(path: Path) -> SdfModel:
    """The first model of an SDF file. Raises InputError."""
    root = parse_xml(path)
    model = root if root.tag == "model" else root.find(".//model")
    if model is None:
        raise InputError(f"{path}: has no <model>; give the SDF of an aircraft")
    file = str(path)
    frames = SdfFrames(model, file)
    links = {name: _body(link, frames.of_link(link), file) for name, link in _named(model, "link")}
    if not links:
        raise InputError(f"{path}: model {model.get('name')!r} has no links; give the SDF of an aircraft")
    uris = tuple((i.findtext("uri") or "").strip() for i in model.findall("include"))
    return SdfModel(file, model.get("name") or path.stem, links, dict(_named(model, "joint")), _plugins(model), uris)


def masses(model: SdfModel) -> tuple[float, Array, Array]:
    """Mass (kg), centre of mass (3,) m and inertia (3, 3) about it of all links as they stand, in the model's axes."""
    bodies = model.links.values()
    mass = sum(body.mass for body in bodies)
    if not mass > 0.0:
        raise InputError(f"{model.file}: the links have no mass; an aircraft needs <inertial>")
    centre = np.asarray(sum((body.mass * body.centre for body in bodies), np.zeros(3)) / mass)
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = body.centre - centre
        inertia += body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, centre, inertia


def _named(model: Element, tag: str) -> Iterator[tuple[str, Element]]:
    return ((element.get("name") or "", element) for element in model.findall(tag))


def _plugins(model: Element) -> tuple[Element, ...]:
    return tuple(model.findall("plugin"))


def _body(link: Element, pose: SdfPose, file: str) -> SdfLink:
    inertial = link.find("inertial")
    if inertial is None:
        return SdfLink(pose, 0.0, pose.place, np.zeros((3, 3)))
    inner = pose.then(pose_of(inertial, file))
    entry = {
        tag: number_in(inertial, f"inertia/{tag}", 0.0, file) for tag in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    }
    tensor = np.array(
        [
            [entry["ixx"], entry["ixy"], entry["ixz"]],
            [entry["ixy"], entry["iyy"], entry["iyz"]],
            [entry["ixz"], entry["iyz"], entry["izz"]],
        ]
    )
    mass = number_in(inertial, "mass", 0.0, file)
    if mass < 0.0:
        raise InputError(f"{file}: link {link.get('name')!r} has a mass of {mass:g} kg; it must not be negative")
    turn = inner.axes.as_matrix()
    return SdfLink(pose, mass, inner.place, turn @ tensor @ turn.T)
