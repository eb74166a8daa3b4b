"""A copy of a JSBSim model with the difference of two aircraft files written into it.

The copy is a tree of its own, ``aircraft/NAME/NAME.xml`` with the engines and systems that it refers to, which JSBSim
loads with that tree as its root. All that the correction does not touch stays as it was, comments included.
"""

from __future__ import annotations

import math
import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.correcting.effect_increments import ModelProperties, increments_between, load_effects
from sysid_node.sim.correcting.jsbsim_loads import Increments, add_increments
from sysid_node.sim.correcting.jsbsim_masses import MassChange, change_inertia, change_mass
from sysid_node.sim.correcting.jsbsim_servos import PARTS, ServoChange, change_servo
from sysid_node.sim.correcting.jsbsim_stall import add_stall, stall_channel
from sysid_node.sim.correcting.jsbsim_throttle import change_throttle
from sysid_node.sim.correcting.xml_editing import append_block, read_document, write_document
from sysid_node.sim.importing.jsbsim.files import ModelFiles, copy_model
from sysid_node.sim.importing.jsbsim.program import Program
from sysid_node.sim.importing.jsbsim.survey import ModelSurvey

Array = NDArray[np.float64]

_SYSTEMS = ("flight_control", "autopilot", "system")

#: Folders in a model's own that hold parts of it.
_OWN_FOLDERS = ("systems", "engines", "engine")

_MASSES = ("mass_error", "inertia_error", "cg_shift")


@dataclass(frozen=True)
class CorrectedModel:
    """The copy's files, and the effects of the correction that it does not hold, with the reason of each."""

    files: ModelFiles
    left_out: dict[str, str]


def write_corrected(survey: ModelSurvey, before: Aircraft, after: Aircraft, folder: Path) -> CorrectedModel:
    """Write a copy of the surveyed model into a folder, with what ``after`` has other than ``before``.

    Raises InputError where the model's parts cannot be read, or where JSBSim does not load the copy.
    """
    files = _copy(survey.files, folder)
    prolog, root = read_document(files.main)
    parts = _Parts.of(files, prolog, root)
    left_out = _change_systems(parts, survey, before, after)
    increments = increments_between(before, after, _properties(survey, root))
    _stall(parts, increments, before, after, left_out)
    add_increments(root, parts.aerodynamics, increments, survey.cg_in)
    parts.write()
    _change_masses(files, before, after)
    old, new = before.effect_values(), after.effect_values()
    held = {*load_effects(), *_MASSES, *(effect for effect, _, _ in PARTS), "control_effectiveness_loss",
            "derivative_error", "motor_lag", "stall_separation"}  # fmt: skip
    left_out |= {e: _why(e) for e in new if e not in held and new[e] != old.get(e)}
    return CorrectedModel(files, left_out)


def _why(effect: str) -> str:
    """Why a JSBSim model does not hold an effect."""
    from sysid_node.sim.effects import EFFECTS  # noqa: PLC0415  # JAX takes its time

    station = EFFECTS[effect].station
    if station in ("sensors", "clock"):
        return "it lies in the flight's instruments, not in the simulator"
    if station == "airflow":
        return "it lies in the air of that flight, not in the simulator"
    return "JSBSim's own blocks cannot express it"


@dataclass(frozen=True)
class _Parts:
    """A model's XML documents that are changed: the main file, and those that its sections are kept in."""

    documents: dict[Path, tuple[str, Element]]
    systems: list[Element]
    aerodynamics: Element
    root: Element

    @classmethod
    def of(cls, files: ModelFiles, prolog: str, root: Element) -> _Parts:
        documents = {files.main: (prolog, root)}
        systems, aerodynamics = [], None
        for element in list(root):
            if element.tag not in (*_SYSTEMS, "aerodynamics"):
                continue
            section = element
            if (name := element.get("file")) is not None:
                path = _included(files, name)
                documents[path] = read_document(path)
                section = documents[path][1]
            if element.tag == "aerodynamics":
                aerodynamics = section
            else:
                systems.append(section)
        if aerodynamics is None:
            raise InputError(f"{files.main}: has no aerodynamics; give an aeroplane's model")
        return cls(documents, systems, aerodynamics, root)

    def write(self) -> None:
        for path, (prolog, root) in self.documents.items():
            write_document(path, prolog, root)


def _copy(files: ModelFiles, folder: Path) -> ModelFiles:
    """The model's own folder, and the engines and systems that it refers to."""
    place = folder / "aircraft" / files.name
    # the folder may hold anything else, the results that are being written among it
    parts = [part for part in files.folder.iterdir() if part.is_dir() and part.name.lower() in _OWN_FOLDERS]
    for source in (files.folder, *parts):
        target = place / source.relative_to(files.folder)
        target.mkdir(parents=True)
        for path in source.glob("*.xml"):
            shutil.copyfile(path, target / path.name)
    for kind, source in (("engine", files.engines), ("systems", files.systems)):
        target = folder / kind
        target.mkdir()
        for name in _referred(files.main):
            for path in (source / name, source / f"{name}.xml"):
                if path.is_file() and not (target / path.name).exists():
                    shutil.copyfile(path, target / path.name)
    return ModelFiles(place, files.name, folder / "engine", folder / "systems", str(place / f"{files.name}.xml"))


def _referred(main: Path) -> list[str]:
    _, root = read_document(main)
    return [Path(str(e.get("file"))).name for e in root.iter() if isinstance(e.tag, str) and e.get("file")]


def _included(files: ModelFiles, file: str) -> Path:
    name = file if file.endswith(".xml") else f"{file}.xml"
    for folder in (files.folder, files.folder / "Systems", files.folder / "systems", files.systems):
        if (folder / name).is_file():
            return folder / name
    raise InputError(f"{files.main}: refers to {name}, which is not found; put it beside the model")


def _change_systems(parts: _Parts, survey: ModelSurvey, before: Aircraft, after: Aircraft) -> dict[str, str]:
    """Servos and throttle; what could not be changed, with the reason."""
    left_out = {}
    old, new = before.effect_values(), after.effect_values()
    for surface in survey.surfaces:
        control, servo = surface.name, survey.servos[surface.name]
        changed, wanted = False, replace(servo)
        for effect, field, _ in PARTS:
            then, now = (e.get(effect, {}).get(control, 0.0) for e in (old, new))
            if now != then:
                changed = True
                setattr(wanted, field, now if math.isfinite(now) else 0.0)
        loss, lost = new.get("control_effectiveness_loss", {}), 0.0
        if loss.get(control, 0.0):
            lost = 1.0 - (1.0 - loss[control]) / (1.0 - old.get("control_effectiveness_loss", {}).get(control, 0.0))
            if loss.get("onset", 0.0) > 0.0:
                left_out["control_effectiveness_loss"] = "it begins in the course of the flight"
                lost = 0.0
        damping = new.get("actuator_lag", {}).get("damping", 0.0) if wanted.lag != servo.lag else 0.0
        if not changed and not lost:
            continue
        if surface.feedback:
            left_out[f"servo of {control}"] = "its position depends on the motion in this model"
        elif not change_servo(
            parts.systems, surface, survey.chains[control], servo, ServoChange(wanted, damping, lost)
        ):
            left_out[f"servo of {control}"] = "no component of the model writes its position"
    left_out |= change_throttle(parts.systems, survey.engines, old, new)
    return left_out


def _properties(survey: ModelSurvey, root: Element) -> ModelProperties:
    surfaces = {s.name: (s.position, s.sign * s.unit) for s in survey.surfaces}
    external = root.find("external_reactions/force[@name='thrust']")
    thrust = "forces/fbx-prop-lbs" if survey.engines else None
    if thrust is None and external is not None:
        thrust = "external_reactions/thrust/magnitude"
    return ModelProperties(surfaces, thrust)


def _stall(parts: _Parts, increments: Increments, before: Aircraft, after: Aircraft, left_out: dict[str, str]) -> None:
    """Flow separation, where the model had none of the aircraft file's."""
    old, new = (a.effect_values().get("stall_separation", {}) for a in (before, after))
    if old == new:
        return
    if old or not parts.systems:
        left_out["stall_separation"] = (
            "the aircraft file has one already, which its tables hold"
            if old
            else "the model has no flight control system to put it into"
        )
        return
    append_block(parts.systems[0], stall_channel(new))
    add_stall(increments, new)


def _change_masses(files: ModelFiles, before: Aircraft, after: Aircraft) -> None:
    """Mass, centre of gravity and inertia: JSBSim says what they are, and the empty aircraft takes the difference."""
    change = MassChange.between(before, after)
    if not change:
        return
    prolog, root = read_document(files.main)
    before_it = _inertia(files)
    change_mass(root, _settled(files), change)
    write_document(files.main, prolog, root)
    change_inertia(root, before_it + np.array(change.inertia) - _inertia(files))
    write_document(files.main, prolog, root)


def _settled(files: ModelFiles) -> Program:
    """JSBSim with the model, its masses computed."""
    with tempfile.TemporaryDirectory(prefix="sysid-") as place:
        program = Program(copy_model(files, Path(place), ()))
    program.fdm.run_ic()
    return program


def _inertia(files: ModelFiles) -> Array:
    """Ixx, Iyy, Izz, Ixz (kg m^2) about the centre of gravity."""
    inertia = _settled(files).inertia
    return np.array([inertia[name] for name in ("Ixx", "Iyy", "Izz", "Ixz")])
