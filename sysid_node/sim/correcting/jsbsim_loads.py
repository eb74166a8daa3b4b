"""What a correction adds to a JSBSim model's forces and moments.

Increments of coefficients are functions ``aero/corrected/CL`` to ``aero/corrected/Cn`` in the model's aerodynamics.
They act as external forces and moments in body axes at the place of the centre of gravity of the model as it was, so
that they do not depend on the axes in which the model states its own aerodynamics, and do not enter what these derive
from the lift. Added thrust acts there as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.sim.correcting.xml_editing import append_block, product_of, text_element

#: Feet in a metre.
_FEET = 1.0 / 0.3048

#: What a term is a product of: names of properties, and functions of them as XML.
Factor = str | Callable[[Element], None]

REGRESSORS: Mapping[str, tuple[str, ...]] = {
    "alpha": ("aero/alpha-rad",),
    "beta": ("aero/beta-rad",),
    "p": ("velocities/p-aero-rad_sec", "aero/bi2vel"),
    "q": ("velocities/q-aero-rad_sec", "aero/ci2vel"),
    "r": ("velocities/r-aero-rad_sec", "aero/bi2vel"),
    "alphadot": ("aero/alphadot-rad_sec", "aero/ci2vel"),
    "V": ("velocities/vt-fps",),
}


@dataclass(frozen=True)
class Term:
    """One term of an increment: a value times factors."""

    value: float
    factors: tuple[Factor, ...] = ()


@dataclass
class Increments:
    """Terms of each coefficient, and of forces (lbf) and moments (lbf ft) along body axes in properties' units."""

    coefficients: dict[str, list[Term]] = field(default_factory=dict)
    forces: dict[str, list[Term]] = field(default_factory=dict)  # X, Y, Z
    moments: dict[str, list[Term]] = field(default_factory=dict)  # L, M, N

    def add(self, where: str, value: float, *factors: Factor) -> None:
        """Add a term to a coefficient, a force or a moment."""
        kind = self.coefficients if where in COEFFICIENTS else self.forces if where in "XYZ" else self.moments
        if value:
            kind.setdefault(where, []).append(Term(value, factors))

    def __bool__(self) -> bool:
        return bool(self.coefficients or self.forces or self.moments)


def add_increments(
    root: Element, aerodynamics: Element, increments: Increments, cg_in: tuple[float, float, float]
) -> None:
    """Write the increments into a model's aerodynamics and external reactions, in place."""
    if not increments:
        return
    for name, terms in increments.coefficients.items():
        function = Element("function", name=_property(name))
        _sum(function, terms)
        append_block(aerodynamics, function)
    external = root.find("external_reactions")
    if external is None:
        external = Element("external_reactions")
        external.text = "\n  "
        append_block(root, external)
    for axis, place in zip("XYZ", ((1, 0, 0), (0, 1, 0), (0, 0, 1)), strict=True):
        _load(external, "force", axis, _force(axis, increments), place, cg_in)
    for axis, place in zip("LMN", ((1, 0, 0), (0, 1, 0), (0, 0, 1)), strict=True):
        _load(external, "moment", axis, _moment(axis, increments), place, None)


def _property(coefficient: str) -> str:
    return f"aero/corrected/{coefficient}"


def _sum(parent: Element, terms: list[Term]) -> None:
    total = text_element(parent, "sum", "")
    text_element(total, "value", 0.0)
    add_terms(total, terms)


def add_terms(total: Element, terms: Iterable[Term]) -> None:
    """Put terms into a sum."""
    for term in terms:
        if not term.factors:
            text_element(total, "value", term.value)
            continue
        product = product_of(total, [], term.value)
        for factor in term.factors:
            if isinstance(factor, str):
                text_element(product, "property", factor)
            else:
                factor(product)


def _force(axis: str, increments: Increments) -> list[Term]:
    """Terms of a force along a body axis."""
    pressure = ("aero/qbar-psf", "metrics/Sw-sqft")
    parts = {
        "X": (("CL", "sin", 1.0), ("CD", "cos", -1.0)),
        "Y": (("CY", "", 1.0),),
        "Z": (("CL", "cos", -1.0), ("CD", "sin", -1.0)),
    }[axis]
    terms = [
        Term(sign, (*pressure, _property(name), *((_turned(turn),) if turn else ())))
        for name, turn, sign in parts
        if name in increments.coefficients
    ]
    return [*terms, *increments.forces.get(axis, [])]


def _moment(axis: str, increments: Increments) -> list[Term]:
    """Terms of a moment about a body axis."""
    name, length = {"L": ("Cl", "bw-ft"), "M": ("Cm", "cbarw-ft"), "N": ("Cn", "bw-ft")}[axis]
    own = [Term(1.0, ("aero/qbar-psf", "metrics/Sw-sqft", f"metrics/{length}", _property(name)))]
    return [*(own if name in increments.coefficients else []), *increments.moments.get(axis, [])]


def _turned(function: str) -> Factor:
    def write(parent: Element) -> None:
        text_element(text_element(parent, function, ""), "property", "aero/alpha-rad")

    return write


def _load(
    external: Element,
    kind: str,
    axis: str,
    terms: list[Term],
    direction: tuple[int, int, int],
    place_in: tuple[float, float, float] | None,
) -> None:
    if not terms:
        return
    load = Element(kind, name=f"corrected-{axis.lower()}", frame="BODY")
    function = text_element(load, "function", "")
    _sum(function, terms)
    if place_in is not None:
        location = text_element(load, "location", "", unit="IN")
        for name, value in zip("xyz", place_in, strict=True):
            text_element(location, name, value)
    along = text_element(load, "direction", "")
    for name, value in zip("xyz", direction, strict=True):
        text_element(along, name, float(value))
    append_block(external, load)


def less(name: str | tuple[str, ...], value: float, power: int = 1) -> Factor:
    """The factor (property - value) to a power; a tuple of properties is their product."""
    names = (name,) if isinstance(name, str) else name

    def write(parent: Element) -> None:
        holder = text_element(parent, "pow", "") if power > 1 else parent
        difference = text_element(holder, "difference", "")
        if len(names) == 1:
            text_element(difference, "property", names[0])
        else:
            product_of(difference, names)
        text_element(difference, "value", value)
        if power > 1:
            text_element(holder, "value", float(power))

    return write


def one_over(*properties: str) -> Factor:
    """The factor 1 / (product of properties)."""

    def write(parent: Element) -> None:
        quotient = text_element(parent, "quotient", "")
        text_element(quotient, "value", 1.0)
        product_of(quotient, properties)

    return write


def metres(value: float) -> float:
    """A length (m) in feet."""
    return value * _FEET
