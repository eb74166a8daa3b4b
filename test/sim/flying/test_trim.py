"""Trim: no accelerations, and messages that name the unknowns at their limits."""

import dataclasses

import numpy as np
import pytest
from plain import DERIVATIVES, make_aircraft

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.errors import InputError
from sysid_node.sim import Simulator, trim_flight

EFFECTS = [
    "lateral_asymmetry:Cl_0=0.004:Cn_0=-0.002:CY_0=0.01",
    "thrust_yaw:torque_arm=0.02",
    "stall_separation:depth=1:alpha_star=0.2",
    "cg_shift:x=-0.01:y=0.01",
]


@pytest.mark.parametrize("effects", [[], EFFECTS])
@pytest.mark.parametrize("airspeed", [16.0, 18.0, 25.0])
def test_nothing_moves_from_trim(simulator, airspeed, effects):
    theta = simulator.vector(effects)
    trim = trim_flight(simulator, airspeed, theta)
    flight = simulator.rollout(theta, trim.initial, simulator.inputs(np.tile(trim.command, (301, 1))))
    assert np.ptp(np.asarray(flight.outputs), axis=0).max() < 1e-7
    assert np.linalg.norm(trim.initial[3:6]) == pytest.approx(airspeed)


def test_trim_balances_weight(simulator):
    trim = trim_flight(simulator)
    pressure_area = 0.5 * 1.2 * 18.0**2 * 0.5
    CL = DERIVATIVES["CL_0"] + DERIVATIVES["CL_alpha"] * trim.alpha + DERIVATIVES["CL_de"] * trim.command[0]
    lift_and_pull = pressure_area * CL + trim.command[-1] * np.sin(trim.alpha)
    assert lift_and_pull == pytest.approx(4.0 * GRAVITY, rel=1e-4)  # air density at that altitude, to 4 digits


def test_climb_and_glide(simulator):
    climb = trim_flight(simulator, climb_angle=0.1)
    assert climb.command[-1] > trim_flight(simulator).command[-1] + 3.0
    glider = Simulator(make_aircraft(throttle=None))
    glide = trim_flight(glider)
    assert glide.command[-1] == 0.0
    CL, CD = 0.0, 0.0
    for name, factor in (("0", 1.0), ("alpha", glide.alpha), ("de", glide.command[0])):
        CL += DERIVATIVES[f"CL_{name}"] * factor
        CD += DERIVATIVES[f"CD_{name}"] * factor
    assert np.tan(-glide.gamma) == pytest.approx(CD / CL, rel=1e-6)


def test_two_controls_slip_instead(aircraft):
    controls = {name: aircraft.controls[name] for name in ("elevator", "aileron")}
    derivatives = {name: d for name, d in aircraft.derivatives.items() if not name.endswith("_dr")}
    simulator = Simulator(dataclasses.replace(aircraft, controls=controls, derivatives=derivatives))
    theta = simulator.vector(["lateral_asymmetry:Cn_0=0.002"])
    trim = trim_flight(simulator, theta=theta)
    v = trim.initial[4]
    assert abs(v) > 0.1


@pytest.mark.parametrize(
    ("airspeed", "pattern"),
    [
        (4.0, "no steady flight at 4 m/s .*; try another"),
        (90.0, r"no steady flight at 90 m/s \(.*thrust"),
        (0.0, "expected 0.1 to 10000 m/s"),
        (1e-300, "expected 0.1 to 10000 m/s"),
    ],
)
def test_a_missing_trim_is_explained(simulator, airspeed, pattern):
    with pytest.raises(InputError, match=pattern):
        trim_flight(simulator, airspeed)


def test_an_aircraft_without_surfaces_is_said_in_one_line():
    bare = dataclasses.replace(make_aircraft(), controls={})
    with pytest.raises(InputError, match=r"^aircraft '.*': has no surfaces; the simulator needs at least one$"):
        trim_flight(Simulator(bare))
