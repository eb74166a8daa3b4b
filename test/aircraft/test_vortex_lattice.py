"""The lattice that computes the shipped derivatives, against theory, a textbook and another program."""

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "aircraft"))

from designs import DESIGNS  # noqa: E402
from make import Aerodynamics, build, mass_properties  # noqa: E402
from vortex_lattice import Flap, Flow, Section, VortexLattice, mirrored  # noqa: E402

from sysid_node.aircraft.dump import dump_aircraft  # noqa: E402


def rectangle(span, panels, flaps=(), chord_panels=8):
    wing = mirrored(Section((0, 0, 0), (0, span / 2, 0), 1.0, 1.0, panels, flaps))
    return VortexLattice(wing, span, span, 1.0, (0.25, 0.0, 0.0), chord_panels)


def test_swept_wing_of_the_textbook():
    """Bertin & Smith, Aerodynamics for Engineers, example 7.2: 45 deg, aspect ratio 5, four panels a side."""
    b, c = 1.0, 0.2
    lattice = VortexLattice(mirrored(Section((0, 0, 0), (b / 2, b / 2, 0), c, c, 4)), b * c, b, c, (0, 0, 0), 1)
    assert lattice.coefficients(Flow(alpha=1e-4))["CL"] / 1e-4 == pytest.approx(3.443, abs=0.005)


def test_two_dimensional_limits():
    """A very long wing is a thin aerofoil: slope 2 pi, lift at the quarter chord; a flap after Glauert."""
    hinge = 0.75
    lattice = rectangle(1000.0, 10, (Flap("flap", hinge),), chord_panels=40)
    lift = lattice.coefficients(Flow(alpha=1e-3))
    assert lift["CL"] / 1e-3 == pytest.approx(2 * np.pi, rel=0.01)
    assert lift["Cm"] == pytest.approx(0.0, abs=1e-6)
    theta = np.arccos(1 - 2 * hinge)
    flap = lattice.coefficients(Flow(controls={"flap": 1e-3}))
    assert flap["CL"] / 1e-3 == pytest.approx(2 * (np.pi - theta + np.sin(theta)), rel=0.02)
    assert flap["Cm"] / 1e-3 == pytest.approx(-0.5 * np.sin(theta) * (1 - np.cos(theta)), rel=0.02)


def test_induced_drag_of_a_wing():
    """A rectangular wing of aspect ratio 8 has a span efficiency a little under one (Glauert's delta 0.05)."""
    c = rectangle(8.0, 40, chord_panels=4).coefficients(Flow(alpha=0.05))
    assert 0.93 < c["CL"] ** 2 / (np.pi * 8 * c["CD"]) < 1.0


def test_flow_is_symmetric():
    lattice = Aerodynamics(DESIGNS["kestrel"](), np.array([0.37, 0.0, 0.02])).lattice
    right = lattice.coefficients(Flow(alpha=0.05, beta=0.02, p=0.01, r=-0.01, controls={"aileron": 0.03}))
    left = lattice.coefficients(Flow(alpha=0.05, beta=-0.02, p=-0.01, r=0.01, controls={"aileron": -0.03}))
    for name, value in right.items():
        sign = 1 if name in ("CL", "CD", "Cm") else -1
        assert left[name] == pytest.approx(sign * value, abs=1e-12)


# AeroSandbox 4.2.10, VortexLatticeMethod, the same sections of cdfp with the CG at the origin, 8 spanwise panels a
# section and 10 along the chord, uniform; central differences at alpha = 0.1.
AEROSANDBOX = {
    "alpha": {"CL": 3.0063, "CD": 0.1992, "Cm": -0.2936},
    "q": {"CL": 3.5968, "CD": 0.1736, "Cm": -1.0876},
    "beta": {"CY": -0.1918, "Cl": -0.0511, "Cn": 0.0433},
    "p": {"CY": 0.1420, "Cl": -0.2487, "Cn": -0.0578},
    "r": {"CY": 0.1237, "Cl": 0.0484, "Cn": -0.0283},
}


@pytest.mark.parametrize("regressor", AEROSANDBOX)
def test_cropped_delta_as_another_program_sees_it(regressor):
    design = DESIGNS["cdfp"]()
    lattice = Aerodynamics(design, mass_properties(design)[1]).lattice
    high, low = ({"alpha": 0.1}, {"alpha": 0.1})
    high[regressor] = high.get(regressor, 0.0) + 1e-3
    low[regressor] = low.get(regressor, 0.0) - 1e-3
    above, below = lattice.coefficients(Flow(**high)), lattice.coefficients(Flow(**low))
    for name, expected in AEROSANDBOX[regressor].items():
        assert (above[name] - below[name]) / 2e-3 == pytest.approx(expected, rel=0.06)


@pytest.mark.parametrize("name", DESIGNS)
def test_the_shipped_file_is_what_the_script_writes(name):
    assert (ROOT / "config" / "aircraft" / f"{name}.yaml").read_text() == dump_aircraft(build(DESIGNS[name]()))
