"""Values in another unit than the file's are noticed; those of real and bundled aircraft are not."""

import warnings

import pytest

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft, parse_aircraft
from sysid_node.errors import ModelWarning

DART = """\
name: dart
mass: 3.0
inertia: {Ixx: 0.2, Iyy: 0.15, Izz: 0.3}
geometry: {S: 0.8, b: 1.5, cbar: 0.6}
reference: {airspeed: 18.0, air_density: 1.2}
controls:
  elevator: {joint: elevator}
  throttle: {joint: throttle, max_thrust: 30.0, arm: 0.01}
sensors: {imu: [0.1, 0.0, -0.02], air_data: [0.5, 0.0, 0.0]}
noise: {accel: 0.05, gyro: 0.002, airspeed: 0.2, alpha: 0.004, beta: 0.004, attitude: 0.005}
derivatives: {CL_alpha: {value: 2.9}, Cm_alpha: {value: -0.4}}
"""

TRANSPORT = """\
name: transport
mass: 285000
inertia: {Ixx: 2.4e7, Iyy: 4.5e7, Izz: 6.7e7}
geometry: {S: 511, b: 59.6, cbar: 8.3}
reference: {airspeed: 70, air_density: 1.2}
controls: {elevator: {joint: elevator}}
sensors: {air_data: [25, 0, 3]}
derivatives: {CL_alpha: {value: 5.7}}
"""

FOAMIE = """\
name: foamie
mass: 0.08
inertia: {Ixx: 4e-4, Iyy: 5e-4, Izz: 8e-4}
geometry: {S: 0.08, b: 0.6, cbar: 0.14}
reference: {airspeed: 5, air_density: 1.2}
controls: {elevator: {joint: elevator}, throttle: {joint: throttle, max_thrust: 1.5}}
derivatives: {CL_alpha: {value: 3.0}}
"""


def bundled(name: str) -> str:
    return dump_aircraft(load_aircraft(name))


@pytest.mark.parametrize("text", [DART, TRANSPORT, FOAMIE, *map(bundled, ("cdrw", "cdfp", "kestrel"))])
def test_ordinary_aircraft_of_any_size_are_taken_without_a_word(text):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert parse_aircraft(text).mass > 0.0


@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        (
            "mass: 3.0",
            "mass: 3000",
            "mass: 3000 kg at 18 m/s on 0.8 m^2 need a lift coefficient of 189",
        ),
        ("b: 1.5, cbar: 0.6", "b: 0.2, cbar: 4.5", "the span b is 0.0444 times the chord cbar; are they exchanged"),
        ("Ixx: 0.2, Iyy: 0.15, Izz: 0.3", "Ixx: 2e6, Iyy: 1.5e6, Izz: 3e6", "inertia.Iyy: 1.5e+06 kg m^2 is a radius"),
        ("air_data: [0.5, 0.0, 0.0]", "air_data: [500, 0, 0]", "sensors.air_data: 500 m from the CG where span and"),
        ("imu: [0.1, 0.0, -0.02]", "imu: [100, 0, -20]", "sensors.imu: 102 m from the CG"),
        ("arm: 0.01", "arm: 10", "controls.throttle.arm: 10 m from the CG"),
        ("max_thrust: 30.0", "max_thrust: 3000", "controls.throttle.max_thrust: 3000 N is 102 times the weight"),
        (
            "CL_alpha: {value: 2.9}",
            "CL_alpha: {value: 0.05}",
            "derivatives.CL_alpha: 0.05 is the lift slope of no",
        ),
        ("gyro: 0.002", "gyro: 0.6", "noise.gyro: 0.6 rad/s (1 sigma) is above 0.5; check the unit"),
        ("alpha: 0.004,", "alpha: 0.3,", "noise.alpha: 0.3 rad (1 sigma) is above 0.2"),
        ("airspeed: 0.2", "airspeed: 20", "noise.airspeed: 20 m/s (1 sigma) is above 5.4"),
    ],
)
def test_a_value_in_another_unit_is_noticed_with_its_line_and_key(right, wrong, words):
    assert right in DART
    with pytest.warns(ModelWarning) as told:
        parse_aircraft(DART.replace(right, wrong), "dart.yaml")
    lines = [str(one.message) for one in told]
    assert any(words in line for line in lines), lines
    assert all(line.startswith("dart.yaml:") and "\n" not in line for line in lines)
