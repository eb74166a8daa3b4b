"""The handbook of an aircraft file. Truth: a textbook's published modes, the linear model, closed formulas."""

import math

import numpy as np
import pytest
from plain import DERIVATIVES, make_aircraft

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import (
    DEFAULT_NOISE,
    Control,
    Geometry,
    Inertia,
    LookupTable,
    ReferenceCondition,
    Sensors,
    Throttle,
    UncertainValue,
)
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.dynamics.handbook.handbook import handbook
from sysid_node.dynamics.handbook.unusual import findings_without_flight
from sysid_node.dynamics.linear_model import DimensionalScales, linear_model
from sysid_node.errors import InputError

#: Nelson (1998), "Flight Stability and Automatic Control", 2nd ed., app. B: the Navion at sea level, 176 ft/s.
NAVION = {
    "CL_0": 0.41, "CL_alpha": 4.44, "CL_de": 0.355, "CD_0": 0.05, "CD_alpha": 0.33,
    "Cm_0": 0.0, "Cm_alpha": -0.683, "Cm_q": -9.96, "Cm_de": -0.923,
    "CY_beta": -0.564, "Cl_beta": -0.074, "Cl_p": -0.410, "Cl_r": 0.107, "Cl_da": -0.134,
    "Cn_beta": 0.071, "Cn_p": -0.0575, "Cn_r": -0.125, "Cn_dr": -0.072,
}  # fmt: skip
FOOT, SLUG = 0.3048, 14.5939


def navion():
    unit = SLUG * FOOT**2
    return make_aircraft(
        NAVION,
        mass=2750.0 / 32.174 * SLUG,
        inertia=Inertia(1048.0 * unit, 3000.0 * unit, 3530.0 * unit),
        geometry=Geometry(184.0 * FOOT**2, 33.4 * FOOT, 5.7 * FOOT),
        reference=ReferenceCondition(176.0 * FOOT, 0.002377 * SLUG / FOOT**3),
        effects={"unsteady_aerodynamics": {"CL_alphadot": UncertainValue(0.0), "Cm_alphadot": UncertainValue(-4.36)}},
    )


def test_the_modes_are_the_textbooks():
    """Nelson (1998), examples 4.3 and 5.3, by hand with three digits."""
    modes = {mode.name: mode.eigenvalue for mode in handbook(navion()).modes}
    published = {"short period": -2.51 + 2.59j, "phugoid": -0.0171 + 0.213j, "Dutch roll": -0.487 + 2.335j}
    published |= {"roll": -8.435, "spiral": -0.00877}
    for name, value in published.items():
        assert modes[name] == pytest.approx(value, rel=0.02, abs=0.003), name


def test_fast_modes_are_the_linear_models():
    """At constant airspeed; the phugoid that this leaves out moves the short period by little."""
    aircraft = make_aircraft()
    book = handbook(aircraft)
    model = linear_model(DERIVATIVES, DimensionalScales.of(aircraft, 18.0, 1.2), book.trim.alpha)
    theirs = np.linalg.eigvals(model.A)
    for mode in book.modes:
        if mode.name in {"short period", "Dutch roll", "roll"}:
            assert np.abs(theirs - mode.eigenvalue).min() < 0.03 * abs(mode.eigenvalue), mode.name


def test_a_stated_stall_is_found_where_the_polar_has_it():
    stall = {"alpha_star": UncertainValue(0.22), "a1": UncertainValue(30.0)}
    book = handbook(make_aircraft(effects={"stall_separation": stall}))
    assert 0.15 < book.performance.stall_alpha < 0.24
    assert "stall_separation" in book.performance.stall_from
    weight = 0.5 * 1.2 * book.performance.stall_speed**2 * 0.5 * book.performance.largest_lift
    assert weight == pytest.approx(4.0 * GRAVITY)


def test_tables_count_as_derivatives_do():
    """A straight table of CL over alpha, and one of Cm over alpha and elevator, in place of a part of derivatives."""
    alpha, elevator = (-0.3, 0.0, 0.3), (-0.5, 0.5)
    rows = tuple(tuple(-0.2 * a - 0.4 * e for e in elevator) for a in alpha)
    tables = (
        LookupTable("CL", ("alpha",), (alpha,), tuple(1.2 * a for a in alpha)),
        LookupTable("Cm", ("alpha", "de"), (alpha, elevator), rows),
    )
    values = {**DERIVATIVES, "CL_alpha": 3.0, "Cm_alpha": -0.4, "Cm_de": -0.5}
    mixed, plain = handbook(make_aircraft(values, tables=tables)), handbook(make_aircraft())
    assert mixed.trim.alpha == pytest.approx(plain.trim.alpha)
    assert mixed.static_margin == pytest.approx(plain.static_margin)
    for a, b in zip(mixed.modes, plain.modes, strict=True):
        assert a.eigenvalue == pytest.approx(b.eigenvalue, rel=1e-6)
    assert "tables over alpha" in mixed.performance.stall_from


def test_thrust_beyond_the_throttles_share_counts_in_trim_and_climb():
    """A table of CD over the throttle: the drag that it takes away, the throttle's own thrust need not overcome."""
    plain = handbook(make_aircraft())
    full, area = make_aircraft().throttle.max_thrust, 0.5 * 1.2 * make_aircraft().reference.airspeed ** 2 * 0.5
    trim = plain.trim.thrust / full
    points, values = (0.0, trim, 1.0), (0.01, 0.0, -0.04)
    found = handbook(make_aircraft(tables=(LookupTable("CD", ("throttle",), (points,), values),)))
    assert found.trim.thrust == pytest.approx(plain.trim.thrust)
    speed, better = found.performance.climb_speed, found.performance.climb_rate - plain.performance.climb_rate
    pressure = area * (speed / make_aircraft().reference.airspeed) ** 2
    assert better == pytest.approx(0.04 * pressure * speed / (4.0 * GRAVITY), rel=0.02)


def test_best_glide_of_a_parabolic_polar_is_the_closed_formula():
    """Largest lift over drag 1 / (2 sqrt(CD0 k)) at CL = sqrt(CD0 / k), without elevator."""
    values = {"CL_0": 0.2, "CL_alpha": 5.0, "CD_0": 0.03, "CD_k": 0.05, "Cm_alpha": -0.5}
    found = handbook(make_aircraft(values)).performance
    assert found.glide_ratio == pytest.approx(1.0 / (2.0 * math.sqrt(0.03 * 0.05)), rel=1e-3)
    speed = math.sqrt(2.0 * 4.0 * GRAVITY / (1.2 * 0.5 * math.sqrt(0.03 / 0.05)))
    assert found.glide_speed == pytest.approx(speed, rel=0.02)


def test_control_power_balances_the_moments():
    aircraft = make_aircraft()
    power, d = handbook(aircraft).power, DERIVATIVES
    assert d["Cl_p"] * power.roll_rate * 1.8 / 36.0 + d["Cl_da"] == pytest.approx(0.0, abs=1e-6)
    for c in ("Cl", "Cn"):
        rest = d[f"{c}_beta"] * power.sideslip + d[f"{c}_da"] * power.sideslip_aileron + d[f"{c}_dr"]
        assert rest == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", ["cdrw", "cdfp", "kestrel"])
def test_shipped_aircraft_look_usual(name):
    assert [f.name for f in handbook(load_aircraft(name)).findings if f.unusual] == []


@pytest.mark.parametrize(
    ("derivative", "factor"),
    [("Cm_alpha", -1.0), ("Cn_beta", -1.0), ("Cl_p", -1.0), ("Cm_de", -1.0), ("Cl_da", 1.0 / 57.3)],
)
def test_a_wrong_sign_or_unit_is_said(derivative, factor):
    book = handbook(make_aircraft({**DERIVATIVES, derivative: factor * DERIVATIVES[derivative]}))
    assert derivative in [f.name for f in book.findings if f.unusual]


def test_a_mass_in_grams_has_no_level_flight():
    with pytest.raises(InputError, match="lift cannot carry the weight"):
        handbook(make_aircraft(mass=4000.0))


UNITS = {
    "distance of sensors.imu": {"sensors": Sensors(imu=(5.0, 0.0, -2.0))},  # cm
    "distance of sensors.air_data": {"sensors": Sensors(air_data=(600.0, 0.0, 0.0))},  # mm
    "throttle.arm": {"throttle": Throttle("throttle", 30.0, arm=-20.0)},  # cm or mm
    "noise.alpha": {"noise": {**DEFAULT_NOISE, "alpha": 0.3}},  # deg
    "noise.gyro": {"noise": {**DEFAULT_NOISE, "gyro": 0.2}},  # deg/s
    "scale of elevator's joint e": {"controls": {"elevator": Control("elevator", "de", {"e": -57.3})}},
    "rate limit of elevator": {"effects": {"actuator_rate_limit": {"elevator": UncertainValue(400.0)}}},  # deg/s
    "cg_shift.x": {"effects": {"cg_shift": {"x": UncertainValue(2.0)}}},  # cm
}


@pytest.mark.parametrize("name", UNITS)
def test_another_unit_of_what_no_flight_shows_is_said(name):
    """Modes and level flight stay as they are, so that nothing else would show it."""
    usual = {f.name for f in findings_without_flight(make_aircraft()) if f.unusual}
    changed = make_aircraft(**UNITS[name])
    assert {f.name for f in findings_without_flight(changed) if f.unusual} - usual == {name}


def test_checks_that_need_no_flight_remain_where_there_is_none():
    found = findings_without_flight(make_aircraft({**DERIVATIVES, "Cl_p": 0.4}, mass=4000.0))
    assert {"mass over wing area", "Ixx over m b^2", "Cl_p"} <= {f.name for f in found if f.unusual}
    assert found[0].unusual and not found[-1].unusual


def test_what_is_not_known_is_left_out():
    controls = {"aileron": Control("aileron", "da", {"aileron": 1.0})}
    values = {name: value for name, value in DERIVATIVES.items() if not name.endswith(("de", "dr"))}
    book = handbook(make_aircraft(values, inertia=Inertia(math.nan, 0.35, 0.6), controls=controls, throttle=None))
    assert {mode.name for mode in book.modes} == {"short period", "phugoid"}
    assert math.isnan(book.trim.elevator) and math.isnan(book.performance.climb_rate)
