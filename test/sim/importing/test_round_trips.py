"""Exported models read in again. Truth: the aircraft that was exported."""

from dataclasses import replace

import numpy as np
import pytest
from aircraft_loads import coefficients
from level_flight import level_flight

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import LookupTable
from sysid_node.sim.export.gazebo.model import gazebo_model
from sysid_node.sim.export.jsbsim import jsbsim_model
from sysid_node.sim.export.rosflight import rosflight_parameters
from sysid_node.sim.importing.gazebo.read import read_gazebo
from sysid_node.sim.importing.jsbsim.read import read_jsbsim
from sysid_node.sim.importing.rosflight import read_rosflight


@pytest.fixture(scope="module")
def kestrel():
    return load_aircraft("kestrel")


def grid(**values):
    """Columns of a state about level flight, with some variables changed."""
    still = dict.fromkeys(("beta", "p", "q", "r", "de", "da", "dr"), 0.0) | {"alpha": 0.04, "V": 16.0}
    size = len(next(iter(values.values())))
    return {name: np.broadcast_to(values.get(name, value), size) for name, value in still.items()}


SERVOS = {
    "actuator_lag": {"elevator": 0.03, "aileron": 0.05, "rudder": 0.02},
    "actuator_rate_limit": {"elevator": 2.0, "aileron": 3.0},
    "actuator_backlash": {"rudder": 0.02},
    "actuator_bias": {"elevator": 0.01},
    "command_delay": {"elevator": 0.02, "throttle": 0.1},
    "motor_lag": {"time_constant": 0.3},
}
SECOND_ORDER = {"actuator_lag": {"elevator": 0.03, "aileron": 0.05, "rudder": 0.02, "damping": 0.7}}


def from_jsbsim(aircraft, effects, folder):
    pytest.importorskip("jsbsim", reason="JSBSim is not installed")
    path = folder / "kestrel.xml"
    path.write_text(jsbsim_model(aircraft, effects))
    return read_jsbsim(str(path), 16.0, 0.0).aircraft


@pytest.mark.slow
def test_jsbsim_holds_every_derivative_servos_and_the_motor(kestrel, tmp_path):
    """Coefficients are linear, so that equal derivatives are equal coefficients in every state."""
    found = from_jsbsim(kestrel, SERVOS, tmp_path)
    assert not found.tables
    for name in {*found.derivatives, *kestrel.derivatives}:
        known = kestrel.derivatives[name].value if name in kestrel.derivatives else 0.0
        assert found.derivatives[name].value == pytest.approx(known, abs=1e-6), name
    assert {n: pytest.approx(v, rel=1e-6) for n, v in SERVOS.items()} == found.effect_values()
    assert found.mass == pytest.approx(kestrel.mass, rel=1e-6)
    assert found.inertia.Iyy == pytest.approx(kestrel.inertia.Iyy, rel=1e-3)  # JSBSim's slugs have four digits
    assert found.throttle.max_thrust == pytest.approx(kestrel.throttle.max_thrust, rel=1e-6)


def test_jsbsim_holds_tables_over_the_throttle_and_servos_of_second_order(kestrel, tmp_path):
    table = LookupTable("CD", ("throttle",), ((0.0, 0.35, 1.0),), (0.02, 0.0, -0.06))
    found = from_jsbsim(replace(kestrel, tables=(table,)), SECOND_ORDER, tmp_path)
    x = grid(alpha=np.full(41, 0.04)) | {"throttle": np.linspace(0.0, 1.0, 41)}
    known, read = (
        coefficients(a, x)[:, 1] - a.throttle.max_thrust * x["throttle"] / (0.5 * 1.225 * 16.0**2 * kestrel.geometry.S)
        for a in (replace(kestrel, tables=(table,)), found)
    )
    np.testing.assert_allclose(read, known, atol=1e-6)
    assert {n: pytest.approx(v, rel=1e-6) for n, v in SECOND_ORDER.items()} == found.effect_values()


@pytest.mark.slow
def test_jsbsim_keeps_a_motor_that_lags_apart_from_the_surfaces(kestrel, tmp_path):
    """A throttle still on its way while a surface is commanded is not moved by that surface."""
    known = replace(kestrel, tables=(LookupTable("CD", ("throttle",), ((0.0, 0.35, 1.0),), (0.02, 0.0, -0.06)),))
    found = from_jsbsim(known, {"motor_lag": {"time_constant": 1.0}}, tmp_path)
    assert {table.over for table in found.tables} == {("throttle",)}
    assert found.effect_values()["motor_lag"]["time_constant"] == pytest.approx(1.0)


def test_jsbsim_says_which_control_it_leaves_out(kestrel, tmp_path):
    pytest.importorskip("jsbsim", reason="JSBSim is not installed")
    flap = replace(kestrel.controls["elevator"], name="flap", symbol="df", joints={"flap": 1.0})
    known = replace(
        kestrel,
        controls=kestrel.controls | {"flap": flap},
        derivatives=kestrel.derivatives | {"CL_df": kestrel.derivatives["CL_de"]},
    )
    path = tmp_path / "kestrel.xml"
    path.write_text(jsbsim_model(known))
    assert any("fcs/flap-position-rad" in note for note in read_jsbsim(str(path), 16.0, 0.0).notes)


def table(coefficient, over, points, function):
    """A table whose values are a function of its points."""
    grids = np.meshgrid(*points, indexing="ij")
    values = function(*grids)
    rows = tuple(map(tuple, values)) if len(over) == 2 else tuple(values)
    return LookupTable(coefficient, over, tuple(map(tuple, points)), rows)


#: A table over each variable, and over two of them at once.
TABLES = (
    table("CL", ("alpha",), [np.array([-0.2, 0.0, 0.1, 0.3])], lambda a: -0.8 * a**2),
    table("CY", ("beta",), [np.array([-0.2, -0.05, 0.0, 0.05, 0.2])], lambda b: 2.0 * b**3),
    table("Cm", ("de",), [np.array([-0.3, 0.0, 0.3])], lambda d: 0.2 * d**2),
    table("Cn", ("dr", "beta"), [np.array([-0.3, 0.0, 0.3]), np.array([-0.2, 0.0, 0.2])], lambda d, b: 0.1 * d * b),
    table("Cl", ("p",), [np.array([-0.15, 0.0, 0.1])], lambda p: 0.5 * p**2),
    table("Cm", ("q",), [np.array([-0.03, 0.01, 0.03])], lambda q: 40.0 * q**2),
    table("Cn", ("r", "alpha"), [np.array([-0.15, 0.0, 0.15]), np.array([-0.1, 0.2])], lambda r, a: 0.3 * r * a),
)


@pytest.fixture(scope="module")
def with_tables(kestrel, tmp_path_factory):
    """The aircraft with tables, and what comes back."""
    known = replace(kestrel, tables=TABLES)
    return known, from_jsbsim(known, {}, tmp_path_factory.mktemp("jsbsim"))


@pytest.mark.parametrize("over", [t.over for t in TABLES], ids="-".join)
def test_jsbsim_holds_tables_over_every_variable(with_tables, over):
    """At the tables' points, the others as in level flight."""
    known, found = with_tables
    level = level_flight(found)  # the one about which the tables were read
    points = next(t.points for t in TABLES if t.over == over)
    columns = [grid.ravel() for grid in np.meshgrid(*points, indexing="ij")]
    x = grid(**dict(zip(over, columns, strict=True)))
    for name in ("alpha", "de", "da", "dr"):
        if name not in over:
            x[name] = np.full(len(columns[0]), level[name])
    ours, theirs = coefficients(known, x), coefficients(found, x)
    np.testing.assert_allclose(theirs - ours, 0.0, atol=1e-6)


#: Coefficients of which both formats hold all derivatives: CL, CY, Cl, Cm, Cn.
HELD = [0, 2, 3, 4, 5]

VARIED = {
    "alpha": np.linspace(-0.05, 0.12, 18),
    "beta": np.linspace(-0.1, 0.1, 9),
    **{rate: np.linspace(-0.01, 0.01, 5) for rate in "pqr"},
    **{symbol: np.linspace(-0.2, 0.2, 5) for symbol in ("de", "da", "dr")},
}


@pytest.fixture(scope="module")
def from_rosflight(kestrel, tmp_path_factory):
    path = tmp_path_factory.mktemp("rosflight") / "kestrel.yaml"
    path.write_text(rosflight_parameters(kestrel).text)
    return read_rosflight(path, 16.0).aircraft


@pytest.fixture(scope="module")
def from_gazebo(kestrel, tmp_path_factory):
    path = tmp_path_factory.mktemp("gazebo") / "kestrel.sdf"
    path.write_text(gazebo_model(kestrel).text)
    return read_gazebo(path, 16.0).aircraft


def test_masses_come_back(kestrel, from_rosflight, from_gazebo):
    for found in (from_rosflight, from_gazebo):
        assert found.mass == pytest.approx(kestrel.mass)
        assert vars(found.inertia) == pytest.approx(vars(kestrel.inertia))


@pytest.mark.parametrize("variable", VARIED)
def test_rosflight_holds_all_but_the_drags_form(kestrel, from_rosflight, variable):
    """Its drag is a parabola of the wing's lift; that of a file with this form is held in ``export/test_rosflight``."""
    states = grid(**{variable: VARIED[variable]})
    ours, theirs = coefficients(kestrel, states), coefficients(from_rosflight, states)
    assert theirs[:, HELD] == pytest.approx(ours[:, HELD], abs=1e-6)


@pytest.mark.parametrize("variable", [name for name in VARIED if name != "beta"])
def test_gazebo_holds_all_but_the_drags_form(kestrel, from_gazebo, variable):
    """Its drag is a parabola of the lift; that of a file with this form is held in ``export/test_gazebo``."""
    states = grid(**{variable: VARIED[variable]})
    ours, theirs = coefficients(kestrel, states), coefficients(from_gazebo, states)
    assert theirs[:, HELD] == pytest.approx(ours[:, HELD], abs=1e-6)


def test_in_sideslip_gazebo_has_the_pressure_of_the_plane_of_symmetry(kestrel, from_gazebo):
    """Its pressure is that of V cos(beta), its sideslip atan(v / u): both undone, the derivatives are the file's.

    With alpha = 0, tan(beta') = v / u = tan(beta).
    """
    beta = np.deg2rad([-15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0])  # nodes of its tables
    level = float(from_gazebo.source.rpartition("alpha ")[2].partition(" ")[0])
    states = grid(beta=beta) | {"alpha": np.full(7, level)}
    theirs = coefficients(from_gazebo, states) / np.cos(beta)[:, None] ** 2
    angle = np.arctan2(np.sin(beta), np.cos(beta) * np.cos(level))
    ours = coefficients(kestrel, states | {"beta": angle})
    assert theirs[:, HELD] == pytest.approx(ours[:, HELD], abs=2e-5)  # alpha is rounded in the source's text
