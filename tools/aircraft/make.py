"""Write config/aircraft/*.yaml: ``python tools/aircraft/make.py [NAME...]`` from the repository's root.

Trims each design in level flight, takes the vortex lattice's derivatives there, adds what a lattice cannot know
(profile drag, lost leading-edge suction, a slender fuselage), and gives each a plausible tolerance.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from designs import DESIGNS, Design
from scipy.optimize import fsolve
from vortex_lattice import Array, Flow, Point, Section, VortexLattice

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.model import Aircraft, Derivative, Geometry, Inertia, ReferenceCondition, Sensors
from sysid_node.aircraft.names import STANDARD_DERIVATIVES, split_derivative

ROOT = Path(__file__).resolve().parents[2]
GRAVITY = 9.80665
STEP = 1e-4  # rad: central differences of smooth functions

#: 1 sigma of a lattice's error: share of the value, and at least this much.
TOLERANCES = {"alpha": (0.10, 0.02), "beta": (0.15, 0.01), "0": (0.25, 0.01)}
RATE_TOLERANCE = (0.25, 0.02)
CONTROL_TOLERANCE = (0.15, 0.005)


def mass_properties(design: Design) -> tuple[float, Array, Inertia]:
    """Mass (kg), CG (m, geometry axes) and inertia about it in body axes (kg m^2)."""
    masses = list(design.points)
    for mass, sections in design.plates:
        masses += _plate(mass, sections)
    m = np.array([mass for mass, _ in masses])
    place = np.array([point for _, point in masses])
    cg = m @ place / m.sum()
    x, y, z = (place - cg).T
    inertia = Inertia(
        Ixx=_round(m @ (y**2 + z**2)),
        Iyy=_round(m @ (x**2 + z**2)),
        Izz=_round(m @ (x**2 + y**2)),
        Ixz=_round(m @ (x * z)),  # both axes turn round from geometry to body: the product keeps its sign
    )
    return float(m.sum()), cg, inertia


def _plate(mass: float, sections: tuple[Section, ...]) -> list[tuple[float, Point]]:
    """Point masses on a 20 by 20 grid of each section, by area."""
    grid = (np.arange(20) + 0.5) / 20
    cells: list[tuple[float, Point]] = []
    for section in sections:
        start, stop = np.array(section.start), np.array(section.stop)
        for eta in grid:
            chord = section.start_chord + eta * (section.stop_chord - section.start_chord)
            width = float(np.linalg.norm((stop - start)[1:])) / 20
            for fraction in grid:
                x, y, z = start + eta * (stop - start) + [fraction * chord, 0.0, 0.0]
                cells.append((width * chord / 20, (float(x), float(y), float(z))))
    total = sum(area for area, _ in cells)
    return [(mass * area / total, point) for area, point in cells]


class Aerodynamics:
    """Coefficients of a design: the lattice, with profile drag, lost suction and fuselage."""

    def __init__(self, design: Design, cg: Array) -> None:
        self.design = design
        point = (float(cg[0]), float(cg[1]), float(cg[2]))
        self.lattice = VortexLattice(design.sections, design.S, design.b, design.cbar, point)

    def __call__(self, flow: Flow) -> dict[str, float]:
        """CL CD CY Cl Cm Cn in the given flow."""
        c = self.lattice.coefficients(flow)
        sa, ca = np.sin(flow.alpha), np.cos(flow.alpha)
        normal, axial = c["CL"] * ca + c["CD"] * sa, c["CD"] * ca - c["CL"] * sa
        # Without suction there is no axial force (Polhamus 1971); part of it is realised.
        axial *= self.design.suction
        c["CL"], c["CD"] = normal * ca - axial * sa, normal * sa + axial * ca + self.design.profile_drag
        if self.design.body is not None:
            # Munk 1924: a slender body in inclined flow has a pure moment 2 (k2 - k1) volume qbar angle.
            moment = 2 * self.design.body.slenderness_factor * self.design.body.volume
            c["Cm"] += moment * flow.alpha / (self.design.S * self.design.cbar)
            c["Cn"] -= moment * flow.beta / (self.design.S * self.design.b)
        return c

    def trim(self, mass: float) -> Flow:
        """Level flight at the reference airspeed: lift and thrust carry the weight, no pitching moment."""
        qbar_S = 0.5 * self.design.density * self.design.airspeed**2 * self.design.S

        def residual(x: Array) -> list[float]:
            c = self(Flow(alpha=x[0], controls={"elevator": x[1]}))
            thrust = c["CD"] / np.cos(x[0])
            return [
                c["CL"] + thrust * np.sin(x[0]) - mass * GRAVITY / qbar_S,
                c["Cm"] + thrust * self.design.throttle.arm / self.design.cbar,
            ]

        alpha, elevator = fsolve(residual, [0.05, 0.0])
        return Flow(alpha=float(alpha), controls={"elevator": float(elevator)})

    def derivative(self, trim: Flow, regressor: str) -> dict[str, float]:
        """Central differences of all coefficients about trim."""
        high, low = (self(_moved(self.design, trim, regressor, step)) for step in (STEP, -STEP))
        return {name: (high[name] - low[name]) / (2 * STEP) for name in high}


def _moved(design: Design, trim: Flow, regressor: str, step: float) -> Flow:
    controls = {control.symbol: name for name, control in design.controls.items()}
    if regressor in controls:
        name = controls[regressor]
        return replace(trim, controls={**trim.controls, name: trim.controls.get(name, 0.0) + step})
    return replace(trim, **{regressor: getattr(trim, regressor) + step})


def derivatives(aerodynamics: Aerodynamics, trim: Flow) -> dict[str, float]:
    """The full linear model: slopes at trim, and offsets such that the model meets the lattice there."""
    regressors = {split_derivative(name)[1] for name in STANDARD_DERIVATIVES} - {"0"}
    slopes = {regressor: aerodynamics.derivative(trim, regressor) for regressor in regressors}
    at_trim = aerodynamics(trim)
    values: dict[str, float] = {}
    for name in STANDARD_DERIVATIVES:
        coefficient, regressor = split_derivative(name)
        if regressor == "0":
            values[name] = (
                at_trim[coefficient]
                - slopes["alpha"][coefficient] * trim.alpha
                - slopes["de"][coefficient] * trim.controls["elevator"]
            )
        else:
            values[name] = slopes[regressor][coefficient]
    return values


def _round(value: float, digits: int = 4) -> float:
    return float(f"{value:.{digits}g}")


def _tolerance(name: str, value: float) -> float:
    regressor = split_derivative(name)[1]
    rates = dict.fromkeys(("p", "q", "r"), RATE_TOLERANCE)
    share, least = {**TOLERANCES, **rates}.get(regressor, CONTROL_TOLERANCE)
    return _round(max(share * abs(value), least), 2)


def build(design: Design) -> Aircraft:
    """The aircraft file's content."""
    mass, cg, inertia = mass_properties(design)
    aerodynamics = Aerodynamics(design, cg)
    values = derivatives(aerodynamics, aerodynamics.trim(mass))
    return Aircraft(
        name=design.name,
        source=design.source,
        mass=_round(mass),
        inertia=inertia,
        geometry=Geometry(_round(design.S), design.b, _round(design.cbar)),
        reference=ReferenceCondition(design.airspeed, design.density),
        controls=design.controls,
        derivatives={name: Derivative(_round(value), _tolerance(name, value)) for name, value in values.items()},
        throttle=design.throttle,
        sensors=Sensors(design.imu, design.air_data),
        noise=design.noise,
    )


def main(names: list[str]) -> None:
    """Write the named aircraft, or all."""
    for name in names or list(DESIGNS):
        text = dump_aircraft(build(DESIGNS[name]()))
        (ROOT / "config" / "aircraft" / f"{name}.yaml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
