"""Aircraft files: what a right one gives, and the one line that a wrong one gets."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import aircraft_folders, load_aircraft, parse_aircraft
from sysid_node.aircraft.model import DEFAULT_NOISE, Derivative, Inertia, Sensors, Throttle
from sysid_node.aircraft.names import RESERVED_SYMBOLS
from sysid_node.errors import InputError
from sysid_node.flight.record import COLUMNS

GOOD = """\
name: dart
source: drawn for this test
mass: 3.0
inertia: {Ixx: 0.2, Iyy: 0.15, Izz: 0.3, Ixz: 0.01}
geometry: {S: 0.8, b: 1.5, cbar: 0.6}
reference: {airspeed: 18.0, air_density: 1.2}
controls:
  elevator: {joints: {left: 0.5, right: 0.5}, limit: 0.35}
  aileron:  {joints: {left: -0.5, right: 0.5}, offset: 0.01, limit: 0.3}
  rudder:   {joint: rudder, scale: -1.0}
  flap:     {joint: flap, symbol: df}
  throttle: {joint: throttle, max_thrust: 30.0, inclination: 0.02, arm: -0.01}
sensors: {imu: [0.1, 0.0, -0.02]}
noise: {gyro: 0.002}
derivatives:
  CL_0: {value: 0.1}
  CL_alpha: {value: 2.9, tolerance: 0.3}
  CD_0: {value: 2e-2}
  CD_k: {value: 0.1}
  Cm_alpha: {value: -0.4, tolerance: 0.05}
  Cm_df: {value: -0.1}
"""


def test_every_value_arrives():
    aircraft = parse_aircraft(GOOD)
    assert (aircraft.name, aircraft.source, aircraft.mass) == ("dart", "drawn for this test", 3.0)
    assert aircraft.inertia == Inertia(0.2, 0.15, 0.3, 0.01)
    assert aircraft.control_symbols == ("de", "da", "dr", "df")
    assert aircraft.controls["aileron"].joints == {"left": -0.5, "right": 0.5}
    assert (aircraft.controls["aileron"].offset, aircraft.controls["aileron"].limit) == (0.01, 0.3)
    assert aircraft.controls["rudder"].joints == {"rudder": -1.0}
    assert aircraft.controls["rudder"].limit is None
    assert aircraft.throttle == Throttle("throttle", 30.0, 0.02, -0.01)
    assert aircraft.sensors == Sensors(imu=(0.1, 0.0, -0.02))
    assert aircraft.noise == {**DEFAULT_NOISE, "gyro": 0.002}
    assert aircraft.derivatives["CL_alpha"] == Derivative(2.9, 0.3)
    assert aircraft.derivatives["CD_0"] == Derivative(0.02, None)  # YAML 1.1 would read 2e-2 as text
    assert aircraft.model_structure["Cm"] == ("alpha", "df")


def test_thrust_in_newton():
    aircraft = parse_aircraft(GOOD.replace("max_thrust: 30.0", "unit: newton"))
    assert aircraft.throttle is not None
    assert aircraft.throttle.max_thrust is None


def test_inertia_may_be_left_out():
    unknown = parse_aircraft(GOOD.replace("inertia: {Ixx: 0.2, Iyy: 0.15, Izz: 0.3, Ixz: 0.01}\n", ""))
    assert all(map(math.isnan, vars(unknown.inertia).values()))
    pitch_only = parse_aircraft(GOOD.replace("{Ixx: 0.2, Iyy: 0.15, Izz: 0.3, Ixz: 0.01}", "{Iyy: 0.15}"))
    assert pitch_only.inertia.Iyy == 0.15
    assert math.isnan(pitch_only.inertia.Ixx)
    assert pitch_only.inertia.Ixz == 0.0


# what to replace, by what, and what the one line must hold
MANY_CONTROLS = "controls:\n" + "".join(f"  flap{i}: {{joint: flap{i}, symbol: f{i}}}\n" for i in range(2000))
MISTAKES = [
    ("mass: 3.0", "mass: -3.0", ("f.yaml:3: mass: got -3.0, expected a positive number (kg, 1e-9 to 1e9)",)),
    ("mass: 3.0", 'mass: "3.0"', ("mass: got the text '3.0'",)),
    ("mass: 3.0", "mass: 3 kg", ("mass: got 3 kg",)),
    ("mass: 3.0", "mass: .nan", ("mass: got .nan",)),
    ("mass: 3.0", "mass: nan", ("mass: got nan",)),
    ("mass: 3.0", "mass: .inf", ("mass: got .inf",)),
    ("mass: 3.0", "mass:", ("mass: got nothing",)),
    ("mass: 3.0", "mass: [3.0]", ("mass: got a list",)),
    ("mass: 3.0\n", "", ("f.yaml:1: top level: key 'mass' is missing; expected the mass in kg",)),
    ("mass: 3.0", "maas: 3.0", ("f.yaml:3: maas: unknown key", "did you mean 'mass'?")),
    ("mass: 3.0", "mass: 3.0\nmass: 4.0", ("f.yaml:4: mass: given twice",)),
    ("S: 0.8, ", "", ("f.yaml:5: geometry: key 'S' is missing", "m^2")),
    ("cbar: 0.6", "c_bar: 0.6", ("geometry.c_bar: unknown key", "did you mean 'cbar'?")),
    ("b: 1.5", "b: 1500", ("geometry: S = 0.8", "check the units")),
    ("geometry: {S: 0.8, b: 1.5, cbar: 0.6}", "geometry: 1", ("geometry: got 1, expected a mapping with S, b, cbar",)),
    ("Izz: 0.3", "Izz: 0.9", ("f.yaml:4: inertia: no rigid body has Izz = 0.9 > Ixx + Iyy = 0.35",)),
    ("Ixz: 0.01", "Ixz: 1e300", ("inertia: no rigid body has Ixz^2 = inf >= Ixx Izz",)),
    ("Ixz: 0.01", "Ixz: 0.3", ("inertia: no rigid body has Ixz^2 = 0.09 >= Ixx Izz = 0.06",)),
    ("airspeed: 18.0", "airspeed: 1e-300", ("got 1e-300, expected a positive number (m/s, 0.1 to 10000)",)),
    ("Iyy: 0.15", "Iyy: 0.0", ("inertia.Iyy: got 0.0, expected a positive number",)),
    ("air_density: 1.2", "air_density: 1200", ("reference.air_density: got 1200",)),
    ("air_density: 1.2", "air_density: 1e-300", ("reference.air_density: got 1e-300",)),
    ("limit: 0.35", "limit: 20", ("f.yaml:8: controls.elevator.limit: got 20", "degrees?")),
    ("offset: 0.01", "offset: 3.0", ("controls.aileron.offset: got 3.0", "degrees?")),
    ("{joint: rudder, scale: -1.0}", "{scale: -1.0}", ("controls.rudder: expected either joint", "joints")),
    ("{joint: rudder, scale: -1.0}", "{joint: rudder, joints: {a: 1}}", ("controls.rudder: expected either joint",)),
    ("{joint: rudder, scale: -1.0}", "{joints: {}}", ("controls.rudder.joints: no joint given",)),
    ("scale: -1.0", "scale: 0", ("controls.rudder.scale: got 0, expected a number other than zero",)),
    ("limit: 0.35", "scale: 2.0", ("controls.elevator.scale: goes with joint",)),
    ("{left: -0.5, right: 0.5}", "{left: -0.5, left: 0.5}", ("aileron.joints.left: given twice",)),
    ("{left: -0.5, right: 0.5}", "{left: 0.4, right: 0.4}", ("f.yaml:9: controls.aileron: joints left, right",)),
    ("{joint: rudder, scale: -1.0}", "{joint: throttle}", ("controls.rudder: joint 'throttle' is already",)),
    (", symbol: df", "", ("controls.flap: not one of elevator, aileron, rudder, throttle", "needs a symbol")),
    ("  rudder: ", "  ruder: ", ("controls.ruder: not one of", "did you mean 'rudder'?")),
    ("  aileron: ", "  da: ", ("controls.da: not one of", "did you mean 'aileron'?")),
    ("controls:\n", MANY_CONTROLS, ("f.yaml:", "controls: 2004 controls, expected at most 32")),
    ("symbol: df", "symbol: alpha", ("controls.flap.symbol: got 'alpha'",)),
    ("symbol: df", "symbol: da", ("controls.flap: symbol 'da' is already that of 'aileron'",)),
    ("limit: 0.35", "symbol: dx", ("controls.elevator.symbol: got 'dx'", "'de'")),
    ("max_thrust: 30.0", "unit: pound", ("throttle.unit: got pound, expected newton",)),
    ("max_thrust: 30.0, ", "", ("controls.throttle: expected either max_thrust",)),
    ("[0.1, 0.0, -0.02]", "[0.1, 0.0]", ("sensors.imu: got 2 values, expected three",)),
    ("[0.1, 0.0, -0.02]", "[0.1, 0.0, aft]", ("sensors.imu[2]: got aft",)),
    ("gyro: 0.002", "gyro: -0.002", ("noise.gyro: got -0.002",)),
    ("gyro: 0.002", "gyro: 1e300", ("noise.gyro: got 1e300", "not negative (up to 1e9)")),
    ("gyro: 0.002", "gyros: 0.002", ("noise.gyros: unknown key", "did you mean 'gyro'?")),
    ("tolerance: 0.05", "tolerance: -0.05", ("f.yaml:20: derivatives.Cm_alpha.tolerance: got -0.05",)),
    ("tolerance: 0.05", "tolerance: 1e-300", ("derivatives.Cm_alpha.tolerance: got 1e-300, expected at least 1e-09",)),
    ("max_thrust: 30.0", "max_thrust: 1e-300", ("throttle.max_thrust: got 1e-300, expected at least 0.001 (N)",)),
    ("value: -0.4, ", "", ("derivatives.Cm_alpha: key 'value' is missing",)),
    ("Cm_alpha:", "CM_alpha:", ("derivatives.CM_alpha:", "did you mean 'Cm_alpha'?")),
    ("Cm_df", "Cm_dg", ("derivatives.Cm_dg: 'dg' is none of 0, alpha",)),
    ("Cm_df", "Cm_k", ("derivatives.Cm_k: the regressor k",)),
    ("CD_0", "CD_alpha", ("derivatives.CD_k: stands in place of CD_alpha",)),
    ("mass: 3.0", "mass: [3.0", ("f.yaml:", "not valid YAML")),
    (GOOD, "", ("f.yaml: the file is empty",)),
    (GOOD, "- 1\n", ("f.yaml:1: top level: got a list",)),
    (GOOD, "[" * 5000, ("f.yaml", "not valid YAML")),
]


@pytest.mark.slow
@pytest.mark.parametrize(("old", "new", "expected"), MISTAKES, ids=[m[2][-1][:40] for m in MISTAKES])
def test_a_mistake_gets_one_line_that_names_it(old, new, expected):
    assert old in GOOD
    with pytest.raises(InputError) as caught:
        parse_aircraft(GOOD.replace(old, new, 1), "f.yaml")
    message = str(caught.value)
    assert "\n" not in message
    for part in expected:
        assert part in message


def test_symbols_cannot_hide_a_signal():
    assert {name for name in COLUMNS if name.islower()} - {"de", "da", "dr"} <= RESERVED_SYMBOLS


def test_files_and_names(tmp_path):
    path = tmp_path / "dart.yaml"
    path.write_text(GOOD)
    assert load_aircraft(path) == load_aircraft(str(path)) == parse_aircraft(GOOD)
    with pytest.raises(InputError, match=r"nowhere.yaml: not found"):
        load_aircraft(tmp_path / "nowhere.yaml")
    with pytest.raises(InputError, match="cannot be read"):
        load_aircraft(tmp_path)
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="cannot be read"):
        load_aircraft(tmp_path / "binary.yaml")
    with pytest.raises(InputError, match="'zeppelin' is not known"):
        load_aircraft("zeppelin")


SHIPPED = sorted(path for folder in aircraft_folders()[:1] for path in folder.glob("*.yaml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_dump_is_the_inverse_of_parse(path):
    aircraft = load_aircraft(path.stem)
    assert aircraft.name == path.stem
    assert parse_aircraft(dump_aircraft(aircraft)) == aircraft


def test_dump_keeps_what_is_not_given():
    text = GOOD.replace("Ixx: 0.2, Iyy: 0.15, Izz: 0.3, Ixz: 0.01", "Iyy: 0.15").replace(
        "source: drawn", "source: Drawn"
    )
    aircraft = parse_aircraft(text)
    again = parse_aircraft(dump_aircraft(aircraft))
    assert repr(again) == repr(aircraft)  # NaN is not equal to itself, but prints the same


@pytest.mark.slow
@given(name=st.text(min_size=1).filter(str.strip), source=st.text().filter(lambda s: not s or s.strip()))
def test_dump_survives_any_text(name, source):
    aircraft = replace(parse_aircraft(GOOD), name=name, source=source)
    assert parse_aircraft(dump_aircraft(aircraft)) == aircraft


@given(
    line=st.integers(0, GOOD.count("\n") - 1),
    start=st.integers(0, 60),
    length=st.integers(0, 12),
    junk=st.text(alphabet="0123456789.-eE:{}[],'\"# \tabcxnil&*!|>\n", max_size=8),
)
def test_a_damaged_file_gives_an_aircraft_or_one_line(line, start, length, junk):
    lines = GOOD.splitlines()
    lines[line] = lines[line][:start] + junk + lines[line][start + length :]
    try:
        aircraft = parse_aircraft("\n".join(lines), "f.yaml")
    except InputError as error:
        assert str(error).startswith("f.yaml")
        assert "\n" not in str(error)
    else:
        assert aircraft.mass > 0


def test_the_example_of_the_documentation_loads():
    page = Path(__file__).parents[2] / "docs" / "reference" / "aircraft_file.md"
    blocks = page.read_text().split("```yaml\n")[1:]
    assert len(blocks) >= 1
    parse_aircraft(blocks[0].split("```")[0], str(page))
