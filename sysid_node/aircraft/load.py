"""Loads aircraft files: every value is checked, and every mistake is one line that names file, line and key."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from sysid_node.aircraft.document import parse_document
from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.reading.body import (
    read_geometry,
    read_inertia,
    read_noise,
    read_noise_bias,
    read_reference,
    read_sensors,
)
from sysid_node.aircraft.reading.controls import read_controls
from sysid_node.aircraft.reading.derivatives import read_derivatives
from sysid_node.aircraft.reading.effects import read_delays, read_effects
from sysid_node.aircraft.reading.plausibility import warn_of_implausible
from sysid_node.aircraft.reading.quantities import Quantities, positive
from sysid_node.aircraft.reading.tables import read_tables
from sysid_node.errors import InputError
from sysid_node.suggestion import did_you_mean
from sysid_node.user_path import user_path

_REQUIRED = {
    "name": "the aircraft's name",
    "mass": "the mass in kg",
    "geometry": "the reference area, span and chord: {S: , b: , cbar: }",
    "reference": "the flight condition of the derivatives: {airspeed: , air_density: }",
    "controls": "the control surfaces, e.g. elevator: {joint: elevator}",
    "derivatives": "the derivatives of the model, e.g. Cm_alpha: {value: -0.5}",
}

_OPTIONAL = ("source", "inertia", "noise", "sensors", "ideal", "delays", "effects", "tables", "outputs")


def load_aircraft(name_or_path: str | Path) -> Aircraft:
    """The aircraft of a file, or one that comes with the package, by name (``"cdrw"``).

    A ``str`` that ends in .yaml or .yml or holds a path separator is a file, any other a name.
    Raises InputError (one line: file, line, dotted key, the value, what was expected).
    """
    path = _find(name_or_path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"aircraft file {path}: not found; give a file or one of {_known_names()}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"aircraft file {path}: cannot be read: {error}") from error
    return parse_aircraft(text, str(path))


def parse_aircraft(text: str, file: str = "<text>") -> Aircraft:
    """The aircraft that a YAML text describes; ``file`` is the name that errors give. Raises InputError.

    Inertias that no rigid body has and sizes that do not go together are an error; where the file is ``ideal`` they are
    a warning (``ModelWarning``), and so are values that no aircraft has, whatever the file.
    """
    fields = parse_document(text, file).fields(_REQUIRED, optional=_OPTIONAL)
    quantities = Quantities()
    ideal = fields["ideal"].truth("true (a simulator's file) or false") if "ideal" in fields else False
    controls, throttle = read_controls(fields["controls"], quantities)
    derivatives = read_derivatives(fields["derivatives"], controls)
    delays = read_delays(fields.get("delays"))
    aircraft = Aircraft(
        name=fields["name"].text("the aircraft's name"),
        source=fields["source"].text("text: where the numbers are from") if "source" in fields else "",
        mass=quantities.read(fields["mass"], "mass", positive("kg")),
        inertia=read_inertia(fields.get("inertia"), quantities, ideal=ideal),
        geometry=read_geometry(fields["geometry"], quantities, ideal=ideal),
        reference=read_reference(fields["reference"], quantities),
        controls=controls,
        derivatives=derivatives,
        throttle=throttle,
        sensors=read_sensors(fields.get("sensors"), quantities),
        noise=read_noise(fields.get("noise")),
        noise_bias=read_noise_bias(fields.get("noise"), ideal=ideal),
        ideal=ideal,
        delays=delays,
        effects=read_effects(fields.get("effects"), controls, throttle, derivatives, delays),
        tables=read_tables(fields.get("tables"), controls, throttle),
        stated_tolerances=quantities.stated,
        outputs=fields["outputs"].text('text, e.g. "elevator=out2:1500:0.001"') if "outputs" in fields else "",
    )
    warn_of_implausible(fields, aircraft)
    return aircraft


def aircraft_folders() -> list[Path]:
    """The folders that are searched for named aircraft: the source tree, then the share folder of the package."""
    prefixes = [sys.prefix, *os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)]
    candidates = [Path(__file__).resolve().parents[2] / "config" / "aircraft"]
    candidates += [Path(prefix) / "share" / "sysid_node" / "config" / "aircraft" for prefix in prefixes if prefix]
    return [folder for folder in candidates if folder.is_dir()]


def _find(name_or_path: str | Path) -> Path:
    name = str(name_or_path)
    if isinstance(name_or_path, Path) or name.endswith((".yaml", ".yml")) or os.sep in name:
        return user_path(name_or_path)
    return _shipped(name)


def _shipped(name: str) -> Path:
    """The file of an aircraft that comes with the package."""
    known = {path.stem: path for folder in reversed(aircraft_folders()) for path in folder.glob("*.yaml")}
    if name in known:
        return known[name]
    meant = did_you_mean(name, sorted(known))
    raise InputError(f"aircraft {name!r} is not known; give a .yaml file or one of {_known_names()}{meant}")


def _known_names() -> str:
    names = {path.stem for folder in aircraft_folders() for path in folder.glob("*.yaml")}
    return ", ".join(sorted(names)) or "none (no aircraft are installed)"
