"""Gazebo's models. Truth: AdvancedLiftDrag.cc, the aircraft that was exported, and this package's own equations."""

import math
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
from aircraft_loads import coefficients
from level_flight import level_flight
from plain import DERIVATIVES, make_aircraft

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Control, Derivative, LookupTable, Throttle
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.export.gazebo.model import gazebo_model
from sysid_node.sim.export.polar import polar_of
from sysid_node.sim.export.servos import step_error
from sysid_node.sim.importing.gazebo.read import gazebo_plant, read_gazebo
from sysid_node.sim.importing.plant import PlantStates

SHARED = Path(__file__).resolve().parents[4] / "shared" / "models"


def read_again(exported, folder, airspeed=16.0):
    path = folder / "model.sdf"
    path.write_text(exported.text)
    return read_gazebo(path, airspeed).aircraft


def said(exported, beginning):
    found = [line for line in exported.left_out if line.startswith(beginning)]
    assert len(found) == 1, exported.left_out
    return found[0]


def grid(aircraft, **values):
    size = len(next(iter(values.values())))
    level = math.radians(2.0)  # a node of the tables that an import makes
    still = dict.fromkeys(("beta", "p", "q", "r", *aircraft.control_symbols), 0.0) | {"alpha": level, "V": 16.0}
    return {name: np.broadcast_to(values.get(name, value), size) for name, value in still.items()}


def test_the_parabola_has_the_files_drag_and_slope():
    aircraft = make_aircraft()
    polar, d = polar_of(aircraft), DERIVATIVES
    trim = trim_flight(Simulator(aircraft))
    assert polar.alpha == pytest.approx(trim.alpha, abs=0.01)  # thrust carries a little of the weight
    at_reference = polar.zero + polar.factor * polar.lift**2
    assert at_reference == pytest.approx(d["CD_0"] + d["CD_alpha"] * polar.alpha)
    assert 2.0 * polar.factor * polar.lift * d["CL_alpha"] == pytest.approx(d["CD_alpha"])


def test_a_polar_beside_a_slope_keeps_both():
    """CD = CD_0 + CD_alpha alpha + CD_k CL^2: value and slope in level flight, by differences."""
    values = {name: Derivative(v) for name, v in {**DERIVATIVES, "CD_k": 0.04}.items()}
    polar = polar_of(replace(make_aircraft(), derivatives=values))

    def drag(alpha):
        lift = polar.lift + DERIVATIVES["CL_alpha"] * (alpha - polar.alpha)
        return DERIVATIVES["CD_0"] + DERIVATIVES["CD_alpha"] * alpha + 0.04 * lift**2, lift

    (below, _), (here, lift), (above, _) = (drag(polar.alpha + d) for d in (-1e-4, 0.0, 1e-4))
    assert polar.zero + polar.factor * lift**2 == pytest.approx(here, rel=1e-6)
    assert 2.0 * polar.factor * lift * DERIVATIVES["CL_alpha"] == pytest.approx((above - below) / 2e-4, rel=1e-6)


def test_derivatives_are_per_degree_of_the_joint():
    """AdvancedLiftDrag.cc: control angles in degrees, CD = CD0 + CL^2 / (pi AR eff)."""
    aircraft = make_aircraft()
    plugin = fromstring(gazebo_model(aircraft).text).find("plugin[@filename='gz-sim-advanced-lift-drag-system']")
    number = lambda tag: float(plugin.find(tag).text)  # noqa: E731
    assert number("Cema") == DERIVATIVES["Cm_alpha"]
    assert number("Cellp") == DERIVATIVES["Cl_p"]
    assert 1.0 / (math.pi * number("AR") * number("eff")) == pytest.approx(polar_of(aircraft).factor)
    surfaces = {s.find("name").text: s for s in plugin.findall("control_surface")}
    assert int(number("num_ctrl_surfaces")) == len(surfaces) == 3
    per_degree = float(surfaces["elevator"].find("Cem_ctrl").text)
    assert per_degree == pytest.approx(DERIVATIVES["Cm_de"] * math.pi / 180.0)


@pytest.mark.parametrize("variable", ["alpha", "de", "da", "dr", "p"])
def test_a_file_with_a_polar_is_exact(tmp_path, variable):
    """CD_0 + CD_k CL^2 is the plugin's own form: all six coefficients to 1e-6."""
    values = {n: d for n, d in load_aircraft("kestrel").derivatives.items() if not n.startswith("CD")}
    values |= {"CD_0": Derivative(0.028), "CD_k": Derivative(0.045)}
    aircraft = replace(load_aircraft("kestrel"), derivatives=values)
    exported = gazebo_model(aircraft)
    found = read_again(exported, tmp_path)
    reach = {"alpha": np.deg2rad(np.arange(-3.0, 7.0)), "p": np.linspace(-0.01, 0.01, 5)}
    x = grid(aircraft, **{variable: reach.get(variable, 0.35 * np.linspace(-1.0, 1.0, 5))})
    flap = np.zeros(len(x["alpha"]))  # both aileron joints alike, which the file does not know
    np.testing.assert_allclose(coefficients(found, x | {"df": flap}), coefficients(aircraft, x), atol=1e-6)
    assert not [line for line in exported.left_out if line.startswith(f"{variable} from")]


def test_what_sideslip_and_pitch_rate_lose_is_said():
    """The plugin's pressure is that of V cos(beta): CY by beta^3, at 0.15 rad 0.2671 0.15 sin^2(0.15) less slope."""
    exported = gazebo_model(load_aircraft("kestrel"))
    line = said(exported, "beta from -0.15 to 0.15 rad: differs in CL by")
    assert line.endswith("(the plugin's pressure is that of the airspeed in the plane of symmetry)")
    assert "CY by 0.00088" in line
    assert "CD by" in said(exported, "alpha from")


def test_masses_servos_rotor_and_centre_of_gravity_come_back(tmp_path):
    kestrel = load_aircraft("kestrel")
    effects = {
        "mass_error": {"error": 0.1},
        "inertia_error": {"Iyy": 0.2, "Ixz": 0.01},
        "cg_shift": {"x": 0.02, "y": 0.004, "z": -0.01},
        "actuator_lag": {"elevator": 0.05, "aileron": 0.03},
        "actuator_rate_limit": {"rudder": 1.5},
        "motor_lag": {"time_constant": 0.2},
        "thrust_scale": {"error": -0.1},
        "thrust_line_offset": {"arm": 0.03},
    }
    exported = gazebo_model(replace(kestrel, throttle=Throttle("throttle", 16.0, 0.05, 0.01)), effects)
    found = read_again(exported, tmp_path)
    assert found.mass == pytest.approx(2.2, rel=1e-6)
    assert found.inertia.Iyy == pytest.approx(1.2 * kestrel.inertia.Iyy, rel=1e-6)
    cross = kestrel.inertia.Ixz + 0.01 * math.sqrt(kestrel.inertia.Ixx * kestrel.inertia.Izz)
    assert found.inertia.Ixz == pytest.approx(cross, rel=1e-6)
    lags = {name: item.value for name, item in found.effects["actuator_lag"].items()}
    assert (lags["elevator"], lags["aileron"]) == pytest.approx((0.05, 0.03))
    assert "rudder" not in lags
    assert {n: i.value for n, i in found.effects["actuator_rate_limit"].items()} == pytest.approx({"rudder": 1.5})
    assert found.effects["motor_lag"]["time_constant"].value == pytest.approx(0.2)
    assert found.throttle.max_thrust == pytest.approx(14.4)
    assert found.throttle.inclination == pytest.approx(0.05)
    # the arm about the new centre: less shift x force, y component z cos + x sin
    assert found.throttle.arm == pytest.approx(0.04 - (-0.01 * math.cos(0.05) + 0.02 * math.sin(0.05)), abs=1e-9)


def test_a_shifted_centre_of_gravity_moves_moments(tmp_path):
    """M' = M - shift x F, by hand: 0.02 m forward of a chord of 0.205 m takes CL 0.02 / 0.205 of Cm."""
    kestrel = load_aircraft("kestrel")
    exported = gazebo_model(kestrel, {"cg_shift": {"x": 0.02}})
    found = read_again(exported, tmp_path)
    x = grid(kestrel, alpha=np.deg2rad(np.arange(-2.0, 7.0)), de=np.full(9, 0.1))
    own = coefficients(kestrel, x)
    drag = coefficients(found, x | {"df": np.zeros(9)})[:, 1]
    along = own[:, 0] * np.cos(x["alpha"]) + drag * np.sin(x["alpha"])
    theirs = coefficients(found, x | {"df": np.zeros(9)})
    assert theirs[:, 4] == pytest.approx(own[:, 4] - 0.02 / 0.205 * along, abs=2e-5)
    assert not [line for line in exported.left_out if line.startswith("cg_shift")]


def test_asymmetric_thrust_is_a_rotor_at_another_place(tmp_path):
    """Yawing moment T (arm + p_factor alpha) in level flight, rolling moment T torque_arm: from the plugins' loads."""
    aircraft = replace(load_aircraft("kestrel"), throttle=Throttle("throttle", 16.0, 0.1))
    exported = gazebo_model(aircraft, {"thrust_yaw": {"arm": 0.01, "p_factor": 0.1, "torque_arm": -0.02}})
    path = tmp_path / "model.sdf"
    path.write_text(exported.text)
    plant = gazebo_plant(path)
    one = np.ones(1)
    controls = {c.symbol: 0.0 * one for c in plant.controls.values()}
    air = [plant.air(PlantStates(16.0 * one, *(0.0 * one,) * 5, controls, share * one))[0] for share in (0.0, 1.0)]
    engine = plant.engine.loads(PlantStates(16.0 * one, *(0.0 * one,) * 5, controls, one))[0]
    level = polar_of(aircraft).alpha
    moment = (engine + air[1] - air[0])[3:]
    assert moment == pytest.approx([16.0 * -0.02, 0.0, 16.0 * (0.01 + 0.1 * level)], rel=0.03, abs=1e-9)
    assert said(exported, "thrust_yaw:") == "thrust_yaw: of p_factor only the moment at level flight's alpha"


@pytest.mark.slow
def test_what_was_read_from_a_plugin_is_found_again(tmp_path):
    """PX4's plane stalls at 0.339 rad about a place 0.12 m behind the link's origin: the fit finds its numbers."""
    path = SHARED / "px4_advanced_plane.sdf"
    if not path.is_file():
        pytest.skip("the models of other projects are not here (../shared/models)")
    aircraft = read_gazebo(path).aircraft
    exported = gazebo_model(aircraft, aircraft.effect_values())
    plugin = fromstring(exported.text).find("plugin[@filename='gz-sim-advanced-lift-drag-system']")
    number = lambda tag: float(plugin.find(tag).text)  # noqa: E731
    known = {"alpha_stall": 0.33914, "CL0": 0.15188, "CLa": 5.015, "Cem0": 0.075}
    for tag, value in known.items():
        assert number(tag) == pytest.approx(value, rel=3e-3), tag
    assert number("CD0") == pytest.approx(0.029, abs=5e-4)
    found = read_again(exported, tmp_path, aircraft.reference.airspeed)
    x = {n: np.zeros(14) for n in (*aircraft.control_symbols, "beta", "p", "q", "r")}
    x |= {"alpha": np.deg2rad(np.arange(-4.0, 10.0)), "V": np.full(14, aircraft.reference.airspeed)}
    ours, theirs = (
        coefficients(a, x | {"throttle": np.full(14, level_flight(a)["throttle"])}) for a in (aircraft, found)
    )
    np.testing.assert_allclose(theirs[:, [0, 1, 4]], ours[:, [0, 1, 4]], atol=5e-4)


def test_flow_separation_becomes_the_plugins_stall():
    """Of the steady curve what alpha_stall gives; how far it is off is said."""
    shape = {"alpha_star": 0.26, "a1": 20.0, "tau1": 10.0, "tau2": 3.0, "CD_X": 0.1, "Cm_X": -0.05}
    exported = gazebo_model(load_aircraft("kestrel"), {"stall_separation": {"depth": 1.0, **shape}})
    plugin = fromstring(exported.text).find("plugin[@filename='gz-sim-advanced-lift-drag-system']")
    assert 0.15 < float(plugin.find("alpha_stall").text) < 0.4
    assert "memory" in said(exported, "stall_separation:")
    assert "CL by" in said(exported, "alpha from")


@pytest.mark.parametrize(
    ("effect", "line"),
    [
        ({"command_delay": {"elevator": 0.05}}, "command_delay: Gazebo's joints and motors have no delay"),
        ({"actuator_backlash": {"elevator": 0.02}}, "actuator_backlash: Gazebo's joint controllers have no free play"),
        ({"unsteady_aerodynamics": {"Cm_alphadot": -2.0}}, "unsteady_aerodynamics: the plugin has no terms"),
        ({"imu_delay": {"delay": 0.02}}, "imu_delay: it lies in the flight's instruments, not in the simulator"),
        ({"steady_wind": {"north": 3.0}}, "steady_wind: it lies in the air of that flight, not in the simulator"),
        ({"structural_mode": {"gain": 0.2}}, "structural_mode: the model is rigid"),
        (
            {"control_effectiveness_loss": {"rudder": 0.3, "onset": 12.0}},
            "control_effectiveness_loss: it begins in the",
        ),
        ({"lateral_asymmetry": {"Cl_0": 0.002}}, "Cl_0 0.002: the plugin has no offsets of side force, roll and yaw"),
        ({"motor_lag": {"time_constant": 0.2}}, "motor_lag: the rotor's speed lags in Gazebo, not its thrust"),
        ({"actuator_lag": {"elevator": 0.05}, "actuator_rate_limit": {"elevator": 1.0}}, "actuator_rate_limit: beside"),
    ],
)
def test_what_gazebo_does_not_hold_is_a_line(effect, line):
    said(gazebo_model(load_aircraft("kestrel"), effect), line)


def test_failures_before_the_flight_and_offsets_are_numbers(tmp_path):
    """30 % of the rudder lost, the elevator off by 0.02 rad: derivatives times 0.7, Cm_0 by Cm_de 0.02."""
    kestrel = load_aircraft("kestrel")
    effects = {"control_effectiveness_loss": {"rudder": 0.3, "onset": -10.0}, "actuator_bias": {"elevator": 0.02}}
    found = read_again(gazebo_model(kestrel, effects), tmp_path)
    x = grid(kestrel, dr=np.array([-0.1, 0.0, 0.1])) | {"df": np.zeros(3)}
    ours, theirs = coefficients(kestrel, x | {"dr": 0.7 * x["dr"], "de": np.full(3, 0.02)}), coefficients(found, x)
    np.testing.assert_allclose(theirs[:, [0, 2, 3, 4, 5]], ours[:, [0, 2, 3, 4, 5]], atol=1e-6)


def test_servos_of_second_order_become_lags(tmp_path):
    """Damping 0.7, time constant 0.05 s: a ramp is followed 0.07 s late. The two steps' largest difference: by hand."""
    exported = gazebo_model(load_aircraft("kestrel"), {"actuator_lag": {"elevator": 0.05, "damping": 0.7}})
    lag = read_again(exported, tmp_path).effects["actuator_lag"]["elevator"].value
    assert lag == pytest.approx(0.07)
    assert "differs by up to 22% of the step" in said(exported, "actuator_lag of second order (damping 0.7)")
    time = np.linspace(0.0, 10.0, 100001)
    w = math.sqrt(1.0 - 0.49)
    second = 1.0 - np.exp(-0.7 * time) * (np.cos(w * time) + 0.7 / w * np.sin(w * time))
    assert step_error(0.7) == pytest.approx(np.abs(second - (1.0 - np.exp(-time / 1.4))).max(), abs=1e-4)


def test_a_joint_of_two_controls_has_one_servo():
    """Elevons: both joints serve elevator and aileron."""
    controls = {"elevator": Control("elevator", "de", {"left": 0.5, "right": 0.5}, limit=0.3),
                "aileron": Control("aileron", "da", {"left": -0.5, "right": 0.5}, limit=0.3)}  # fmt: skip
    derivatives = {n: d for n, d in load_aircraft("kestrel").derivatives.items() if not n.endswith("_dr")}
    aircraft = replace(load_aircraft("kestrel"), controls=controls, derivatives=derivatives)
    exported = gazebo_model(aircraft, {"actuator_lag": {"elevator": 0.02, "aileron": 0.04}})
    assert "its servo lags by the mean, 0.03 s" in said(exported, "actuator_lag: joint left serves elevator 0.02 s")
    limits = [float(e.text) for e in fromstring(exported.text).iter("upper")]
    assert limits == pytest.approx([0.6, 0.6])


@pytest.mark.slow
def test_tables_over_two_variables_are_told_with_their_size():
    table = LookupTable("Cm", ("alpha", "de"), ((-0.2, 0.0, 0.3), (-0.35, 0.0, 0.35)),
                        ((0.02, 0.0, -0.02), (0.0, 0.0, 0.0), (-0.03, 0.0, 0.03)))  # fmt: skip
    exported = gazebo_model(replace(load_aircraft("kestrel"), tables=(table,)))
    assert "Cm by" in said(exported, "alpha and de together")
