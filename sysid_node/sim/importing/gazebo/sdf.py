"""A model's links, joints, masses and plugins, from its SDF. Gazebo's axes are forward-left-up."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sysid_node.errors import InputError
from sysid_node.sim.importing.xml_document import parse_xml

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SdfPose:
    """A frame: its origin (3,) m and axes in the model's frame."""

    place: Array = field(default_factory=lambda: np.zeros(3))
    axes: Rotation = field(default_factory=Rotation.identity)

    def then(self, other: SdfPose) -> SdfPose:
        """The pose of a frame that is given in this one."""
        return SdfPose(self.place + self.axes.apply(other.place), self.axes * other.axes)


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
    links = {name: _body(link, file) for name, link in _named(model, "link")}
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


def number(element: Element, file: str) -> float:
    """The element's text as a number. Raises InputError."""
    return numbers(element, file, 1)[0]


def numbers(element: Element, file: str, count: int) -> list[float]:
    """The element's text as so many finite numbers. Raises InputError."""
    try:
        values = [float(text) for text in (element.text or "").split()]
    except ValueError:
        values = []
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise InputError(f"{file}: <{element.tag}>: got {(element.text or '').strip()!r}, expected {count} numbers")
    return values


def number_in(parent: Element, tag: str, default: float, file: str) -> float:
    """A number of a child element, or the default where it is absent."""
    element = parent.find(tag)
    return default if element is None else number(element, file)


def vector_in(parent: Element, tag: str, default: tuple[float, float, float], file: str) -> Array:
    """Three numbers of a child element, or the default where it is absent."""
    element = parent.find(tag)
    return np.array(default if element is None else numbers(element, file, 3), dtype=float)


def _named(model: Element, tag: str) -> Iterator[tuple[str, Element]]:
    return ((element.get("name") or "", element) for element in model.findall(tag))


def _plugins(model: Element) -> tuple[Element, ...]:
    return tuple(model.findall("plugin"))


def _pose(parent: Element, file: str) -> SdfPose:
    element = parent.find("pose")
    if element is None or not (element.text or "").strip():
        return SdfPose()
    x, y, z, roll, pitch, yaw = numbers(element, file, 6)
    return SdfPose(np.array([x, y, z]), Rotation.from_euler("xyz", [roll, pitch, yaw]))


def _body(link: Element, file: str) -> SdfLink:
    # poses relative to a joint are those of wheels and sensors; without a frame of its own a link is in the model's
    pose = _pose(link, file)
    inertial = link.find("inertial")
    if inertial is None:
        return SdfLink(pose, 0.0, pose.place, np.zeros((3, 3)))
    inner = pose.then(_pose(inertial, file))
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
    turn = inner.axes.as_matrix()
    return SdfLink(pose, number_in(inertial, "mass", 0.0, file), inner.place, turn @ tensor @ turn.T)
