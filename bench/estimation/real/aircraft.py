"""The real aircraft as the estimator knows them: geometry from beside the records, models as the references state them.

The derivatives' values only say what size to expect: estimates are not drawn to them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import yaml

from sysid_node.aircraft.model import Aircraft, Control, Derivative, Geometry, Inertia, ReferenceCondition, Throttle
from sysid_node.aircraft.reading.body import default_noise_bias

CONTROLS = {"elevator": "de", "aileron": "da", "rudder": "dr"}


def twin_otter(folder: Path) -> Aircraft:
    """Longitudinal model of SIDPAC's example."""
    beliefs = _of("CL", {"0": 0.4, "alpha": 6.0, "q": 18.0, "de": 0.6}) | _of("CD", {"0": 0.06, "alpha": 0.1})
    beliefs |= _of("Cm", {"0": 0.05, "alpha": -1.5, "q": -37.0, "de": -1.9})
    return _aircraft(folder, "twin_otter", ReferenceCondition(72.0, 1.03), ["elevator"], beliefs, Throttle("throttle"))


def attas(folder: Path) -> Aircraft:
    """Lateral model in rates, sideslip, aileron and rudder."""
    beliefs = _of("CY", {"0": 0.01, "beta": -1.0, "p": 0.2, "r": 0.6, "da": 0.01, "dr": 0.2})
    beliefs |= _of("Cl", {"0": 0.01, "beta": -0.06, "p": -0.4, "r": 0.2, "da": -0.1, "dr": 0.02})
    beliefs |= _of("Cn", {"0": 0.01, "beta": 0.13, "p": -0.05, "r": -0.2, "da": -0.01, "dr": -0.07})
    return _aircraft(folder, "attas", ReferenceCondition(131.0, 0.73), ["aileron", "rudder"], beliefs)


def hfb320(folder: Path) -> Aircraft:
    """Longitudinal model with the airspeed's effects; the engines' thrust line from Jategaonkar's example."""
    beliefs = _of("CL", {"0": -0.1, "V": 0.15, "alpha": 4.3}) | _of("CD", {"0": 0.12, "V": -0.06, "alpha": 0.32})
    beliefs |= _of("Cm", {"0": 0.1, "V": 0.01, "alpha": -1.0, "q": -35.0, "de": -1.5})
    Iyy = _numbers(folder)["hfb320"]["inertia"]["Iyy"]
    engines = Throttle("throttle", inclination=0.0524, arm=-7.0153e-6 * Iyy)
    return _aircraft(folder, "hfb320", ReferenceCondition(104.67, 0.792), ["elevator"], beliefs, engines)


def thor(folder: Path) -> Aircraft:
    """The model that the University of Minnesota's simulator of this very aircraft holds (Ultra Stick 25e, 2011; how
    flights led to it: Dorobantu, Murch, Mettler & Balas (2013), Journal of Aircraft 50(4)).

    Its polar is made linear at the lift of level flight; what it knows of its servos (8 Hz) is left out.
    """
    beliefs = _of("CL", {"0": 0.1086, "alpha": 4.58, "q": 6.1639, "de": 0.0983}) | _of("CD", {"0": 0.045, "alpha": 0.1})
    beliefs |= _of("Cm", {"0": -0.0278, "alpha": -0.723, "q": -13.5664, "de": -0.8488})
    beliefs |= _of("CY", {"0": 0.0, "beta": -0.4889, "p": -0.0375, "r": 0.15, "dr": 0.1913})
    beliefs |= _of("Cl", {"0": 0.0, "beta": -0.0545, "p": -0.4496, "r": 0.1086, "da": -0.1646, "dr": 0.0115})
    beliefs |= _of("Cn", {"0": 0.0, "beta": 0.0723, "p": 0.118, "r": -0.1833, "da": 0.0574, "dr": -0.1811})
    return _aircraft(folder, "thor", ReferenceCondition(17.0, 1.2), list(CONTROLS), beliefs, Throttle("throttle"))


def cessna_longitudinal(folder: Path) -> Aircraft:
    """Sizes as the records have them; the true model is not published."""
    beliefs = _of("CL", {"0": 0.3, "alpha": 5.0, "q": 5.0, "de": 0.4}) | _of("CD", {"0": 0.03, "alpha": 0.3})
    beliefs |= _of("Cm", {"0": 0.02, "alpha": -0.8, "q": -19.0, "de": -1.4})
    return _aircraft(folder, "cessna", ReferenceCondition(80.0, 1.112), ["elevator"], beliefs, Throttle("throttle"))


def cessna_lateral(folder: Path, moved: Sequence[str] = ("aileron", "rudder")) -> Aircraft:
    """Sizes as the records have them; the true model is not published. Only the controls that were moved."""
    beliefs = _of("CY", {"0": 0.02, "beta": -0.8, "p": 0.02, "r": 0.3, "da": 0.02, "dr": 0.2})
    beliefs |= _of("Cl", {"0": 0.02, "beta": -0.1, "p": -0.45, "r": 0.2, "da": -0.19, "dr": 0.03})
    beliefs |= _of("Cn", {"0": 0.02, "beta": 0.14, "p": -0.05, "r": -0.3, "da": -0.01, "dr": -0.1})
    rested = [CONTROLS[name] for name in ("aileron", "rudder") if name not in moved]
    kept = {name: d for name, d in beliefs.items() if name.partition("_")[2] not in rested}
    return _aircraft(folder, "cessna", ReferenceCondition(80.0, 1.112), moved, kept)


def _of(coefficient: str, values: Mapping[str, float]) -> dict[str, Derivative]:
    return {f"{coefficient}_{regressor}": Derivative(value) for regressor, value in values.items()}


def _numbers(folder: Path) -> Mapping[str, Mapping[str, Mapping[str, float]]]:
    """Masses, inertias and geometries beside the records."""
    known: Mapping[str, Mapping[str, Mapping[str, float]]] = yaml.safe_load((folder / "aircraft.yaml").read_text())
    return known


def _aircraft(
    folder: Path,
    name: str,
    reference: ReferenceCondition,
    controls: Sequence[str],
    beliefs: Mapping[str, Derivative],
    throttle: Throttle | None = None,
) -> Aircraft:
    numbers = _numbers(folder)[name]
    moments = {axis: numbers["inertia"].get(axis, math.nan) for axis in ("Ixx", "Iyy", "Izz")}
    return Aircraft(
        name=name,
        source="mass, inertia and geometry from beside the record; derivatives rounded from published results",
        mass=float(numbers["mass"]),  # type: ignore[arg-type]
        inertia=Inertia(**moments, Ixz=numbers["inertia"].get("Ixz", 0.0)),
        geometry=Geometry(**numbers["geometry"]),
        reference=reference,
        controls={c: Control(c, CONTROLS[c], {c: 1.0}) for c in controls},
        derivatives=dict(beliefs),
        throttle=throttle,
        # as exact as the programs take it that the estimates are compared with
        ideal=True,
        noise_bias=default_noise_bias(ideal=True),
    )
