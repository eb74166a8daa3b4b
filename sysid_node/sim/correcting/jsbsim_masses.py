"""Mass, centre of gravity and inertia of a JSBSim model changed in its mass balance."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.correcting.xml_editing import text_element
from sysid_node.sim.importing.jsbsim.program import FOOT, INCH, SLUG, Program

Array = NDArray[np.float64]

_POUND_MASS = 0.45359237
_INERTIA = SLUG * FOOT * FOOT


@dataclass(frozen=True)
class MassChange:
    """What is added to the mass (share), the centre of gravity (m, body axes) and the moments of inertia (kg m^2)."""

    share: float
    shift: tuple[float, float, float]
    inertia: tuple[float, float, float, float]  # Ixx, Iyy, Izz, Ixz

    @classmethod
    def between(cls, before: Aircraft, after: Aircraft) -> MassChange:
        """By which ``after`` differs, its effects included."""
        shares, shifts, moments = [], [], []
        for aircraft in (before, after):
            effects = aircraft.effect_values()
            shares.append(aircraft.mass * (1.0 + effects.get("mass_error", {}).get("error", 0.0)))
            shifts.append([effects.get("cg_shift", {}).get(axis, 0.0) for axis in "xyz"])
            error, own = effects.get("inertia_error", {}), aircraft.inertia
            cross = own.Ixz + error.get("Ixz", 0.0) * float(np.sqrt(own.Ixx * own.Izz))
            straight = [getattr(own, name) * (1.0 + error.get(name, 0.0)) for name in ("Ixx", "Iyy", "Izz")]
            moments.append([*straight, cross])
        x, y, z = (new - old for old, new in zip(*shifts, strict=True))
        Ixx, Iyy, Izz, Ixz = (new - old for old, new in zip(*moments, strict=True))
        return cls(shares[1] / shares[0] - 1.0, (x, y, z), (Ixx, Iyy, Izz, Ixz))

    def __bool__(self) -> bool:
        return any(abs(x) > 1e-12 for x in (self.share, *self.shift, *self.inertia))


def change_mass(root: Element, program: Program, change: MassChange) -> None:
    """Change the empty aircraft, in place, so that the whole has the change of mass and centre of gravity.

    ``program`` runs the model as it was. Fuel and loads stay where they are. Raises InputError where the empty aircraft
    has no mass or place.
    """
    balance = root.find("mass_balance")
    empty = None if balance is None else balance.find("emptywt")
    place = None if balance is None else balance.find("location[@name='CG']")
    if balance is None or empty is None or place is None:
        raise InputError("the model's mass_balance lacks emptywt or the location CG; complete it")
    fdm = program.fdm
    whole = float(fdm["inertia/mass-slugs"]) * SLUG
    own = float(fdm["inertia/empty-weight-lbs"]) * _POUND_MASS
    centre = np.array([float(fdm[f"inertia/cg-{axis}-in"]) for axis in "xyz"])
    added = change.share * whole
    wanted = centre + np.array([-1.0, 1.0, -1.0]) * np.array(change.shift) / INCH
    unit = 1.0 if place.get("unit", "IN").upper() == "IN" else {"M": INCH, "FT": 1.0 / 12.0}[place.get("unit", "IN")]
    before = np.array([float((place.findtext(axis) or "0").strip()) for axis in "xyz"]) / unit
    after = ((whole + added) * wanted - (whole * centre - own * before)) / (own + added)
    empty.text = repr((own + added) / (1.0 if empty.get("unit", "LBS") == "KG" else _POUND_MASS))
    for axis, value in zip("xyz", (after * unit).tolist(), strict=True):
        element = place.find(axis)
        if element is None:
            text_element(place, axis, value)
        else:
            element.text = repr(value)


def change_inertia(root: Element, change: Array) -> None:
    """Add moments (Ixx, Iyy, Izz, Ixz), kg m^2, to those of the empty aircraft, in place, each in its own unit."""
    balance = root.find("mass_balance")
    assert balance is not None
    for tag, value in zip(("ixx", "iyy", "izz", "ixz"), change.tolist(), strict=True):
        element = balance.find(tag)
        # JSBSim's product of inertia is minus the usual one, unless the file says otherwise
        signed = -value if tag == "ixz" and balance.get("negated_crossproduct_inertia", "true") == "true" else value
        if element is None:
            text_element(balance, tag, signed / _INERTIA, unit="SLUG*FT2")
            continue
        unit = 1.0 if element.get("unit", "SLUG*FT2") == "KG*M2" else _INERTIA
        element.text = repr(float((element.text or "0").strip()) + signed / unit)
