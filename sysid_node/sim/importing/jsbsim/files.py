"""A JSBSim model's files: found by name or path, and copied with surfaces that nothing but this program moves."""

from __future__ import annotations

import shutil
from collections.abc import Collection
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from sysid_node.errors import InputError
from sysid_node.sim.importing.xml_document import parse_xml

#: Elements that hold components of a flight control system.
_SYSTEMS = ("flight_control", "autopilot", "system")


@dataclass(frozen=True)
class ModelFiles:
    """Where a model lies: its folder, its name, and the folders of engines and systems that it may refer to."""

    folder: Path
    name: str
    engines: Path
    systems: Path
    label: str  # what a user calls it

    @property
    def main(self) -> Path:
        """The model's own file."""
        return self.folder / f"{self.name}.xml"


def find_model(model: str) -> ModelFiles:
    """The files of a model: a path to its XML, or the name of an aircraft that comes with JSBSim.

    Raises InputError where JSBSim is not installed or there is no such model.
    """
    root = jsbsim_root()
    path = Path(model)
    if path.suffix.lower() == ".xml" or path.is_file():
        if not path.is_file():
            raise InputError(f"{model}: not found; give a model's XML file, or the name of an aircraft of JSBSim")
        if path.suffix.lower() != ".xml":
            raise InputError(f"{model}: JSBSim's models are .xml files; give one, or another --format")
        return _beside(path.resolve(), root)
    folder = root / "aircraft" / model
    if model not in _names(root):
        raise InputError(
            f"JSBSim has no aircraft {model!r}; give a model's XML file, or one of {', '.join(_names(root))}"
        )
    return ModelFiles(folder, model, root / "engine", root / "systems", model)


def jsbsim_root() -> Path:
    """The folder of JSBSim's own aircraft and engines. Raises InputError where JSBSim is not installed."""
    spec = find_spec("jsbsim")
    if spec is None or spec.origin is None:
        raise InputError("JSBSim is not installed, and a JSBSim model is read by it; run: pip install jsbsim==1.3.3")
    return Path(spec.origin).parent


def _names(root: Path) -> list[str]:
    return sorted(p.name for p in (root / "aircraft").iterdir() if (p / f"{p.name}.xml").is_file())


def _beside(path: Path, root: Path) -> ModelFiles:
    """The files of a model outside of JSBSim: engines beside its own tree if it lies in one, else JSBSim's."""
    tree = path.parent.parent.parent
    engines, systems = (tree / name if (tree / name).is_dir() else root / name for name in ("engine", "systems"))
    return ModelFiles(path.parent, path.stem, engines, systems, str(path))


def sections(files: ModelFiles) -> list[Element]:
    """All sections of the model with systems and aerodynamics, those in files of their own among them."""
    found = []
    for element in parse_xml(files.main):
        file = element.get("file")
        if element.tag not in (*_SYSTEMS, "aerodynamics"):
            continue
        found.append(element if file is None else _included(files, file))
    return found


def _included(files: ModelFiles, file: str) -> Element:
    name = file if file.endswith(".xml") else f"{file}.xml"
    for folder in (files.folder, files.folder / "Systems", files.folder / "systems", files.systems):
        if (folder / name).is_file():
            return parse_xml(folder / name)
    raise InputError(f"{files.main}: refers to {name}, which is not found; put it beside the model")


def copy_model(files: ModelFiles, place: Path, without: Collection[str], at_once: Collection[str] = ()) -> ModelFiles:
    """A copy under ``place`` without the components that write any of these properties, and without outputs.

    Actuators that read a property of ``at_once`` have no lag and no delay in it.
    """
    folder = place / "aircraft" / "model"
    shutil.copytree(files.folder, folder, ignore=lambda _, names: [n for n in names if _unneeded(n)])
    (folder / files.main.name).rename(folder / "model.xml")
    systems = place / "systems"
    if files.systems.is_dir():
        shutil.copytree(files.systems, systems)
    for path in [*folder.rglob("*.xml"), *systems.rglob("*.xml")]:
        _strip(path, set(without), set(at_once), main=path == folder / "model.xml")
    return ModelFiles(folder, "model", files.engines, systems, files.label)


def _unneeded(name: str) -> bool:
    return Path(name).suffix.lower() in (".png", ".jpg", ".jpeg", ".ac", ".rgb", ".pdf", ".txt", ".wav", ".gif")


def _strip(path: Path, without: set[str], at_once: set[str], main: bool) -> None:
    """Remove in place what writes these properties."""
    try:
        root = parse_xml(path)
    except InputError:
        return  # not part of the model: JSBSim will say so if it needs it
    holders = [root] if root.tag in _SYSTEMS else [e for e in root if e.tag in _SYSTEMS]
    for holder in holders:
        written: set[str] = set()
        for channel in [holder, *holder.findall("channel")]:
            for component in [c for c in channel if without & set(outputs_of(c))]:
                channel.remove(component)
                written |= set(outputs_of(component))
        for name in sorted(written):  # others may read what a removed component wrote
            holder.insert(0, Element("property"))
            holder[0].text = name
    for actuator in (a for holder in holders for a in holder.iter("actuator")):
        if at_once & {(i.text or "").strip().partition("[")[0] for i in actuator.findall("input")}:
            for element in [*actuator.findall("lag"), *actuator.findall("delay")]:
                actuator.remove(element)
    if main:
        for tag in ("output", "input"):
            for element in root.findall(tag):
                root.remove(element)
    ElementTree.ElementTree(root).write(path)


def outputs_of(component: Element) -> list[str]:
    """The properties that a component of a flight control system writes."""
    name = component.get("name")
    found = [(o.text or "").strip() for o in component.findall("output")]
    if name and component.tag not in ("channel", "function", "property"):
        found.append(component_property(name))
    return found


def component_property(name: str) -> str:
    """The property that JSBSim gives to a component of this name."""
    plain = "-".join(name.strip().lower().split())
    return plain if "/" in plain else f"fcs/{plain}"
