"""What an aircraft file says besides derivatives: tolerances, effects, delays, tables, constant errors of sensors."""

import math
import warnings
from dataclasses import replace
from pathlib import Path

import pytest

from sysid_node.aircraft.default_tolerances import DEFAULT_NOISE_BIAS, DEFAULT_TOLERANCES, UNKNOWN_SERVO_LAG
from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft, parse_aircraft
from sysid_node.aircraft.model import LookupTable, UncertainValue
from sysid_node.errors import InputError, ModelWarning

GOOD = """\
name: dart
mass: {value: 3.0, tolerance: 0.02}
inertia: {Ixx: {value: 0.2, tolerance: 0.004}, Iyy: 0.15, Izz: 0.3, Ixz: 0.01}
geometry: {S: 0.8, b: {value: 1.5, tolerance: 0.001}, cbar: 0.6}
reference: {airspeed: 18.0, air_density: 1.2}
controls:
  elevator: {joints: {left: {value: 0.5, tolerance: 0.03}, right: {value: 0.5, tolerance: 0.04}}, limit: 0.35}
  aileron: {joint: aileron, scale: {value: -0.5, tolerance: 0.01}, offset: {value: 0.01, tolerance: 0.002}}
  flap: {joint: flap, symbol: df}
  throttle: {joint: throttle, max_thrust: {value: 30.0, tolerance: 2.0}, arm: 0.01}
sensors: {imu: [{value: 0.1, tolerance: 0.005}, 0.0, -0.02]}
noise: {gyro: 0.002, bias: {gyro: 0.001}}
delays: {imu: {value: 0.008, tolerance: 0.002}, actuators: 0.01}
effects:
  actuator_lag: {elevator: {value: 0.03, tolerance: 0.01}, aileron: 0.04, damping: 0.7}
  actuator_rate_limit: 6.0
  command_delay: {delay: 0.01, elevator: 0.02}
  stall_separation: {depth: 1.0, alpha_star: {value: 0.26, tolerance: 0.03}}
  derivative_error: {Cm_alpha: 0.05}
tables:
  - {coefficient: CL, over: [alpha], alpha: [-0.2, 0.0, 0.2, 0.35], values: [0.0, 0.0, 0.01, -0.2]}
  - {coefficient: Cm, over: [alpha, df], alpha: [0.0, 0.2], df: [-0.3, 0.0, 0.3], values: [[0, 0, 0], [0.1, 0, -0.1]]}
derivatives:
  CL_alpha: {value: 2.9, tolerance: 0.3}
  Cm_alpha: {value: -0.4, tolerance: 0.05}
"""


def test_numbers_stay_plain_and_have_their_tolerances():
    aircraft = parse_aircraft(GOOD)
    assert (aircraft.mass, aircraft.inertia.Ixx, aircraft.geometry.b) == (3.0, 0.2, 1.5)
    assert aircraft.sensors.imu == (0.1, 0.0, -0.02)
    sigma = aircraft.tolerances
    assert (sigma["mass"], sigma["inertia.Ixx"], sigma["geometry.b"], sigma["sensors.imu.x"]) == (
        0.02,
        0.004,
        0.001,
        0.005,
    )
    assert (sigma["throttle.max_thrust"], sigma["controls.aileron.offset"], sigma["delays.imu"]) == (2.0, 0.002, 0.002)
    assert (sigma["imu_bias.p"], sigma["imu_bias.ax"]) == (0.001, DEFAULT_NOISE_BIAS["accel"])


def test_a_controls_scale_has_a_relative_tolerance():
    """0.01 of 0.5; and of two joints in proportion to their scales: sqrt(sum (s t)^2) / sum s^2."""
    sigma = parse_aircraft(GOOD).tolerances
    assert sigma["controls.aileron.scale"] == pytest.approx(0.02)
    assert sigma["controls.elevator.scale"] == pytest.approx(0.5 * math.hypot(0.03, 0.04) / 0.5)


def test_the_air_densitys_tolerance_is_in_kg_m3_and_counts_relative():
    """0.024 of 1.2 kg/m^3 is 2 %."""
    stated = GOOD.replace("air_density: 1.2", "air_density: {value: 1.2, tolerance: 0.024}")
    assert stated != GOOD
    aircraft = parse_aircraft(stated)
    assert aircraft.reference.air_density == 1.2
    assert aircraft.tolerances["air_density"] == pytest.approx(0.02)
    assert parse_aircraft(GOOD).tolerances["air_density"] == 0.01
    assert parse_aircraft(dump_aircraft(aircraft)) == aircraft
    assert aircraft.tolerances.keys() == parse_aircraft(GOOD).tolerances.keys()


def test_a_delay_may_stand_among_the_effects():
    """Both mean the same: value and tolerance of the topic's stamps."""
    other = GOOD.replace("delays: {imu: {value: 0.008, tolerance: 0.002}, actuators: 0.01}\n", "").replace(
        "effects:\n", "effects:\n  imu_delay: {value: 0.008, tolerance: 0.002}\n  actuator_stamp_delay: 0.01\n"
    )
    one, two = parse_aircraft(GOOD), parse_aircraft(other)
    assert one.stamp_delays == two.stamp_delays
    assert {topic: delay.value for topic, delay in one.stamp_delays.items()} == {
        "imu": 0.008,
        "air_data": 0.0,
        "actuators": 0.01,
    }
    for topic in one.delays:
        assert one.tolerances[f"delays.{topic}"] == two.tolerances[f"delays.{topic}"], topic


def test_what_is_not_stated_has_a_default():
    sigma = parse_aircraft(GOOD).tolerances
    assert sigma["inertia.Iyy"] == pytest.approx(0.05 * 0.15)
    assert sigma["inertia.Ixz"] == pytest.approx(0.02 * math.sqrt(0.2 * 0.3))
    assert sigma["actuator_lag.aileron"] == pytest.approx(0.2 * 0.04)
    assert sigma["actuator_lag.flap"] == UNKNOWN_SERVO_LAG
    assert sigma["imu_misalignment.roll"] == sigma["imu_scale.q"] == 0.01
    assert sigma["stall_separation.alpha_star"] == 0.03
    assert all(size >= 0 and math.isfinite(size) for size in sigma.values())


def test_every_shipped_aircraft_has_a_tolerance_for_every_quantity():
    sigma = load_aircraft("cdrw").tolerances
    for key in ("mass", "inertia.Izz", "geometry.S", "sensors.air_data.z", "controls.rudder.scale", "delays.actuators"):
        assert sigma[key] > 0
    assert replace(load_aircraft("cdrw"), mass=8.0).tolerances["mass"] == 2 * sigma["mass"]


def test_every_default_has_a_source():
    assert all(default.source and default.meaning for default in DEFAULT_TOLERANCES)


def test_an_ideal_file_has_no_tolerances_but_those_it_states():
    ideal = parse_aircraft("ideal: true\n" + GOOD)
    assert (ideal.tolerances["mass"], ideal.tolerances["actuator_lag.elevator"]) == (0.02, 0.01)
    stated = {key for key, value in ideal.tolerances.items() if value}
    assert stated == {
        *("mass", "inertia.Ixx", "geometry.b", "controls.elevator.scale", "controls.aileron.scale"),
        *("controls.aileron.offset", "throttle.max_thrust", "sensors.imu.x", "imu_bias.p", "imu_bias.q", "imu_bias.r"),
        *("delays.imu", "actuator_lag.elevator", "stall_separation.alpha_star"),
    }


def test_effects_have_an_entry_for_each_control():
    effects = parse_aircraft(GOOD).effects
    assert effects["actuator_lag"] == {
        "elevator": UncertainValue(0.03, 0.01),
        "aileron": UncertainValue(0.04),
        "damping": UncertainValue(0.7),
    }
    assert effects["actuator_rate_limit"] == dict.fromkeys(("elevator", "aileron", "flap"), UncertainValue(6.0))
    late = dict.fromkeys(("elevator", "aileron", "flap", "throttle"), UncertainValue(0.01))
    assert effects["command_delay"] == late | {"elevator": UncertainValue(0.02)}


def test_effect_values_hold_the_delays():
    values = parse_aircraft(GOOD).effect_values()
    assert values["imu_delay"] == {"delay": 0.008}
    assert values["actuator_stamp_delay"] == {"delay": 0.01}
    assert "air_data_delay" not in values
    assert values["stall_separation"] == {"depth": 1.0, "alpha_star": 0.26}


def test_tables():
    one, two = parse_aircraft(GOOD).tables
    assert one == LookupTable("CL", ("alpha",), ((-0.2, 0.0, 0.2, 0.35),), (0.0, 0.0, 0.01, -0.2))
    assert (two.over, two.points[1], two.values[1]) == (("alpha", "df"), (-0.3, 0.0, 0.3), (0.1, 0.0, -0.1))


@pytest.mark.parametrize("head", ["", "ideal: true\n"])
def test_dump_is_the_inverse_of_parse(head):
    aircraft = parse_aircraft(head + GOOD)
    again = parse_aircraft(dump_aircraft(aircraft))
    assert again == aircraft
    assert again.tolerances == aircraft.tolerances


X8 = GOOD.replace("Ixx: {value: 0.2, tolerance: 0.004}, Iyy: 0.15, Izz: 0.3", "Ixx: 1.229, Iyy: 0.1702, Izz: 0.8808")


def test_inertias_of_no_rigid_body_are_a_warning_in_a_simulators_file():
    """The Skywalker X8's published moments (Gryte et al., 2018): Ixx 1.229 > Iyy + Izz."""
    with pytest.raises(InputError, match="no rigid body"):
        parse_aircraft(X8)
    with pytest.warns(ModelWarning, match="no rigid body has Ixx = 1.229"):
        assert parse_aircraft("ideal: true\n" + X8).inertia.Ixx == 1.229


def test_a_right_file_gives_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert parse_aircraft("ideal: true\n" + GOOD).ideal


# what to replace, by what, and what the one line must hold
MISTAKES = [
    (
        "mass: {value: 3.0,",
        "mass: {value: -3.0,",
        "f.yaml:2: mass.value: got -3.0, expected a positive number (kg, 1e-9 to 1e9)",
    ),
    ("tolerance: 0.02}", "tolerance: -1}", "f.yaml:2: mass.tolerance: got -1, expected 1 sigma in the value's unit"),
    (
        "tolerance: 0.02}",
        "tolerence: 1}",
        "mass.tolerence: unknown key; expected one of value, tolerance; did you mean",
    ),
    ("air_density: 1.2", "air_density: {value: 12}", "reference.air_density.value: got 12, expected an air density"),
    ("bias: {gyro: 0.001}", "bias: {giro: 0.001}", "noise.bias.giro: unknown key"),
    ("delays: {imu:", "delays: {imus:", "delays.imus: unknown key; expected one of imu, air_data, actuators"),
    ("actuators: 0.01", "actuators: 10", "delays.actuators: got 10, expected a delay in s, at most 0.5 (is it in ms?)"),
    ("actuator_lag:", "actuater_lag:", "effects.actuater_lag: effect not known; did you mean 'actuator_lag'?"),
    ("aileron: 0.04", "ruder: 0.04", "effects.actuator_lag.ruder: parameter not known; known: elevator, aileron, flap"),
    ("aileron: 0.04", "aileron: 40", "effects.actuator_lag.aileron: got 40, expected a number from 0 to 1 s"),
    ("actuator_rate_limit: 6.0", "actuator_rate_limit: 0", "actuator_rate_limit: got 0, expected a number from 0.02"),
    (
        "actuator_rate_limit: 6.0",
        "vane_bias: 0.1",
        "effects.vane_bias: got 0.1, expected a mapping with some of alpha, b",
    ),
    ("actuator_rate_limit: 6.0", "gust: {}", "effects.gust: no parameter given; expected some of forward, right, down"),
    ("actuator_rate_limit: 6.0", "imu_delay: 0.01", "effects.imu_delay: delays.imu states the same; keep one"),
    ("coefficient: CL,", "coefficient: Cl_alpha,", "tables[0].coefficient: got 'Cl_alpha', expected one of CL"),
    (
        "over: [alpha], alpha",
        "over: [alfa], alpha",
        "over[0]: got 'alfa', expected one of alpha, beta, V, Mach, p, q, r",
    ),
    ("over: [alpha, df]", "over: [alpha, alpha]", "tables[1].over: got alpha, alpha; expected a list of one or two of"),
    (
        "over: [alpha], alpha: [-0.2, 0.0,",
        "over: [alpha], alpha: [-0.2, 0.3,",
        "alpha: got 0.2 after 0.3; the points must",
    ),
    (
        "alpha: [-0.2, 0.0, 0.2, 0.35]",
        "alpha: [0.1]",
        "f.yaml:21: tables[0].alpha: got 1 points, expected at least two",
    ),
    ("0.35], values", "35.0], values", "tables[0].alpha: got points from -0.2 to 35 rad; is it in degrees?"),
    ("0.01, -0.2]", "0.01]", "tables[0].values: got 3 values, expected 4, one for each point of alpha"),
    ("0.01, -0.2]", "0.01, .nan]", "tables[0].values[3]: got .nan, expected a number"),
    ("[[0, 0, 0], [0.1", "[[0.1", "tables[1].values: got 1 rows, expected 2, one for each point of alpha"),
    (
        "over: [alpha], alpha",
        "over: [throtle], alpha",
        "over[0]: got 'throtle', expected one of alpha, beta, V, Mach, p, q, r, de, da, df, throttle; did you mean",
    ),
    ("df: [-0.3, 0.0, 0.3], ", "", "tables[1]: key 'df' is missing; expected its points (rad)"),
    ("name: dart", "name: dart\nideal: perhaps", "f.yaml:2: ideal: got perhaps, expected true"),
]


@pytest.mark.parametrize(("old", "new", "expected"), MISTAKES, ids=[m[2][-30:] for m in MISTAKES])
def test_a_mistake_gets_one_line_that_names_it(old, new, expected):
    assert old in GOOD
    with pytest.raises(InputError) as caught:
        parse_aircraft(GOOD.replace(old, new, 1), "f.yaml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("f.yaml:")
    assert expected in message


def test_the_documentation_states_every_default_and_its_blocks_load():
    page = (Path(__file__).parents[2] / "docs" / "reference" / "aircraft_file.md").read_text()
    for default in DEFAULT_TOLERANCES:
        assert default.source in page
        assert f"`{default.pattern}`" in page or default.pattern == "*"
    text = GOOD[: GOOD.index("effects:")] + GOOD[GOOD.index("derivatives:\n  CL") :]
    text = text.replace("flap: {joint: flap, symbol: df}", "rudder: {joint: rudder}")
    tolerances, effects, tables = (block.split("```")[0] for block in page.split("```yaml\n")[2:5])
    aircraft = parse_aircraft(text + effects + tables)
    assert len(aircraft.effects) == 5
    assert len(aircraft.tables) == 2
    other = [line for line in text.splitlines() if not line.startswith(("reference:", "delays:", "noise:"))]
    stated = parse_aircraft("\n".join([*other, tolerances]))
    assert stated.tolerances["air_density"] == pytest.approx(0.005)
    assert set(stated.effects) >= {"airspeed_scale", "imu_misalignment", "cg_shift"}
