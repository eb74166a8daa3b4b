"""Poses of an SDF model's links, joints and frames: in degrees or rad, and relative to each other."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sysid_node.errors import InputError
from sysid_node.sim.importing.gazebo.numbers import numbers

Array = NDArray[np.float64]

#: Names of the model's own frame.
_MODEL = ("", "__model__")


@dataclass(frozen=True)
class SdfPose:
    """A frame: its origin (3,) m and axes in the model's frame."""

    place: Array = field(default_factory=lambda: np.zeros(3))
    axes: Rotation = field(default_factory=Rotation.identity)

    def then(self, other: SdfPose) -> SdfPose:
        """The pose of a frame that is given in this one."""
        return SdfPose(self.place + self.axes.apply(other.place), self.axes * other.axes)


class SdfFrames:
    """Where a model's links, joints and frames stand in the model's frame; they share one set of names."""

    def __init__(self, model: Element, file: str) -> None:
        self._file = file
        kinds = ("link", "joint", "frame")
        self._elements = {(e.get("name") or ""): e for kind in kinds for e in model.findall(kind)}

    def of_link(self, link: Element) -> SdfPose:
        """The link's pose. Raises InputError where it is relative to something that cannot be found."""
        return self._of(link, ())

    def _of(self, element: Element, seen: tuple[str, ...]) -> SdfPose:
        """The pose of an element, of which those that are ``seen`` are given relative to it."""
        base, name = _base_of(element), element.get("name") or ""
        own = pose_of(element, self._file)
        if base in _MODEL:
            return own
        asked = (*seen, name)
        if base not in self._elements or base in asked:
            why = (
                f"stands relative to {base!r}, which the model does not have"
                if base not in asked
                else "stands in a circle"
            )
            raise InputError(f"{self._file}: {element.tag} {name!r} {why}; correct its <pose>")
        return self._of(self._elements[base], asked).then(own)


def pose_of(parent: Element, file: str) -> SdfPose:
    """The pose of a child element ``pose``, as it stands. Raises InputError."""
    element = parent.find("pose")
    if element is None or not (element.text or "").strip():
        return SdfPose()
    x, y, z, *angles = numbers(element, file, 6)
    degrees = (element.get("degrees") or "").strip().lower() in ("true", "1")
    return SdfPose(np.array([x, y, z]), Rotation.from_euler("xyz", angles, degrees=degrees))


def _base_of(element: Element) -> str:
    """What an element's pose is relative to: what it says, else a joint's child and what a frame is attached to."""
    pose = element.find("pose")
    said = (pose.get("relative_to") or "").strip() if pose is not None else ""
    if said or element.tag == "link":
        return said
    other = element.findtext("child") if element.tag == "joint" else element.get("attached_to")
    return (other or "").strip()
