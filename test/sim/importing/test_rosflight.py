"""ROSflight's parameters read in. Truth: Beard & McLain (2012), "Small Unmanned Aircraft", ch. 4, written here anew."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from aircraft_loads import loads, planes, scales
from level_flight import level_flight

from sysid_node.errors import InputError
from sysid_node.sim.importing.rosflight import read_rosflight

SHARED = Path(__file__).resolve().parents[4] / "shared" / "models"

#: A small aircraft of our own; derivatives per full deflection, no largest angle: it blends at stall.
SMALL = {
    **{"rho": 1.2, "mass": 2.0, "wing_s": 0.4, "wing_b": 1.6, "wing_c": 0.25, "wing_M": 40.0, "wing_epsilon": 0.9},
    **{"wing_alpha0": 0.3, "Jxx": 0.12, "Jyy": 0.09, "Jzz": 0.19, "Jxz": 0.01, "servo_tau": 0.03},
    **{"C_L_O": 0.2, "C_L_alpha": 5.0, "C_L_q": 6.0, "C_L_delta_e": 0.2, "C_D_p": 0.03, "C_D_q": 0.1},
    **{"C_D_delta_e": 0.02, "C_m_O": 0.02, "C_m_alpha": -0.9, "C_m_q": -12.0, "C_m_delta_e": -0.6},
    **{"C_Y_beta": -0.5, "C_Y_delta_r": 0.2, "C_ell_beta": -0.08, "C_ell_p": -0.5, "C_ell_r": 0.1},
    **{"C_ell_delta_a": 0.12, "C_n_beta": 0.07, "C_n_p": -0.04, "C_n_r": -0.1, "C_n_delta_r": -0.06},
    **{"D_prop": 0.3, "CT_0": 0.09, "CT_1": -0.06, "CT_2": -0.1, "CQ_0": 0.006, "CQ_1": 0.004, "CQ_2": -0.015},
    **{"KQ": 0.012, "V_max": 16.0, "R_motor": 0.05, "I_0": 1.0},
}


def theirs(p, x, throttle, *, blend):
    """Forces and moments (N, 6) of chapter 4, eqs. 4.6 to 4.20; joints in the file's unit, aileron rolling right."""
    get = lambda name: float(p.get(name, 0.0))  # noqa: E731
    S, b, c, rho = (get(n) for n in ("wing_s", "wing_b", "wing_c", "rho"))
    V, a, beta, ph, qh, rh = (x[n] for n in ("V", "alpha", "beta", "p", "q", "r"))
    de, da, dr = x["de"], -x["da"], x["dr"]
    M, a0 = get("wing_M"), get("wing_alpha0")
    sigma = (1 + np.exp(-M * (a - a0)) + np.exp(M * (a + a0))) / (
        (1 + np.exp(-M * (a - a0))) * (1 + np.exp(M * (a + a0)))
    )
    linear = get("C_L_O") + get("C_L_alpha") * a
    wing = (1 - sigma) * linear + sigma * 2 * np.sign(a) * np.sin(a) ** 2 * np.cos(a) if blend else linear
    drag = get("C_D_p") + linear**2 / (3.14159 * 0.9 * b**2 / S)
    lift = wing + get("C_L_q") * qh + get("C_L_delta_e") * de
    drag = drag + get("C_D_q") * qh + get("C_D_delta_e") * de
    sides = [
        get(f"C_{n}_O") + get(f"C_{n}_beta") * beta + get(f"C_{n}_p") * ph + get(f"C_{n}_r") * rh
        + get(f"C_{n}_delta_a") * da + get(f"C_{n}_delta_r") * dr
        for n in ("Y", "ell", "n")
    ]  # fmt: skip
    pitch = get("C_m_O") + get("C_m_alpha") * a + get("C_m_q") * qh + get("C_m_delta_e") * de
    scale = 0.5 * rho * V**2 * S
    thrust, torque = propeller(get, rho, V, throttle)
    return np.column_stack(
        [
            scale * (-drag * np.cos(a) + lift * np.sin(a)) + thrust,
            scale * sides[0],
            scale * (-drag * np.sin(a) - lift * np.cos(a)),
            scale * b * sides[1] - torque,
            scale * c * pitch,
            scale * b * sides[2],
        ]
    )


def propeller(get, rho, V, throttle):
    """Thrust (N) and torque (N m): the speed at which motor and propeller have the same torque, by bisection."""

    def torques(omega):
        n = omega / (2 * np.pi)
        motor = get("KQ") * ((get("V_max") * throttle - get("KQ") * omega) / get("R_motor") - get("I_0"))
        drag = rho * get("D_prop") ** 5 * n**2 * ratio(omega, "CQ")
        return motor, drag

    def ratio(omega, name):
        J = 2 * np.pi * V / (omega * get("D_prop"))
        return get(f"{name}_0") + get(f"{name}_1") * J + get(f"{name}_2") * J**2

    low, high = np.full_like(V, 1.0), np.full_like(V, 1e4)
    for _ in range(80):
        middle = 0.5 * (low + high)
        motor, drag = torques(middle)
        low, high = np.where(motor > drag, middle, low), np.where(motor > drag, high, middle)
    n = low / (2 * np.pi)
    return rho * get("D_prop") ** 4 * n**2 * ratio(low, "CT"), torques(low)[1]


def parameters_of(path):
    nodes = yaml.safe_load(path.read_text()).values()
    return {name: float(value) for node in nodes for name, value in node["ros__parameters"].items()}


@pytest.mark.parametrize("name", ["small", "rosflight_aerosonde_dynamics", "rosflight_anaconda_dynamics"])
def test_loads_are_those_of_the_book_at_the_tables_points(tmp_path, name):
    path = SHARED / f"{name}.yaml"
    if name == "small":
        path = tmp_path / "small.yaml"
        path.write_text(yaml.safe_dump({"/**": {"ros__parameters": SMALL}}))
    elif not path.is_file():
        pytest.skip("the models of other projects are not here (../shared/models)")
    aircraft = read_rosflight(path).aircraft
    parameters = parameters_of(path)
    level = level_flight(aircraft)
    x = planes(aircraft, level)
    thrust = x["throttle"] * aircraft.throttle.max_thrust
    blend = not any(n.startswith("max_") for n in parameters)
    error = loads(aircraft, x, thrust) - theirs(parameters, x, x["throttle"], blend=blend)
    assert np.abs(error / scales(aircraft, x)).max() < 1e-6


def test_thrust_follows_the_throttle_as_in_the_book(tmp_path):
    """At the tables' points, where full throttle gives several times what the level flight's share promises."""
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": SMALL}}))
    aircraft = read_rosflight(path).aircraft
    level = level_flight(aircraft)
    throttle = np.append(np.linspace(0.4, 1.0, 13), level["throttle"])
    for V in (level["V"], 0.8 * level["V"]):
        x = {n: np.full(throttle.size, level.get(n, 0.0)) for n in ("alpha", "beta", "p", "q", "r", "de", "da", "dr")}
        x |= {"V": np.full(throttle.size, V), "throttle": throttle}
        error = loads(aircraft, x, throttle * aircraft.throttle.max_thrust) - theirs(SMALL, x, throttle, blend=True)
        assert np.abs(error / scales(aircraft, x)).max() < 1e-6


def test_missing_coefficients_are_said(tmp_path):
    path = tmp_path / "small.yaml"
    every = dict.fromkeys(("C_Y_O", "C_Y_p", "C_Y_r", "C_Y_delta_a", "C_ell_O", "C_ell_delta_r", "C_n_O"), 0.0) | SMALL
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": every}}))
    said = "Missing coefficients are taken as zero, as rosflight_sim takes them: C_n_delta_a."
    assert said in read_rosflight(path).notes
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": every | {"C_n_delta_a": 0.0}}}))
    assert not any("Missing" in note for note in read_rosflight(path).notes)


def test_products_of_inertia_that_a_file_has_not_are_said(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": SMALL | {"Jxy": -0.019, "Jyz": 0.001}}}))
    said = "Ixy or Iyz is 10.0% of the largest moment of inertia; a file has Ixz only."
    assert said in read_rosflight(path).notes


def test_half_a_propeller_is_one_line(tmp_path):
    path = tmp_path / "small.yaml"
    parameters = {name: value for name, value in SMALL.items() if name != "R_motor"}
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}))
    with pytest.raises(InputError, match="R_motor is missing"):
        read_rosflight(path)


def test_between_the_points_the_error_is_that_of_interpolation(tmp_path):
    """Half way between nodes 0.5 degrees apart: h^2 / 8 of the curvature, which is largest at stall."""
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": SMALL}}))
    aircraft = read_rosflight(path).aircraft
    level = level_flight(aircraft)
    alpha = np.deg2rad(np.arange(-15.0, 25.0, 0.5) + 0.25)
    x = {n: np.full(alpha.size, v) for n, v in {**dict.fromkeys(("beta", "p", "q", "r"), 0.0), **level}.items()}
    x["alpha"] = alpha
    error = loads(aircraft, x, level["throttle"] * aircraft.throttle.max_thrust) - theirs(
        SMALL, x, level["throttle"], blend=True
    )
    assert np.abs(error / scales(aircraft, x)).max() < 5e-3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", "no wing_s under ros__parameters"),
        ("[1", "not valid YAML"),
        ("a: 2026-13-45", "not valid YAML"),
        ("a: {ros__parameters: {wing_s: 1.0, wing_b: big}}", "wing_b: got 'big', expected a number"),
        ("a: {ros__parameters: {wing_s: 1.0}}", "wing_b is missing"),
        (f"a: {{ros__parameters: {{wing_s: {10**400}}}}}", "wing_s: got 1000.*, expected a number"),
    ],
)
def test_what_is_no_model_is_one_line(tmp_path, text, said):
    path = tmp_path / "model.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_rosflight(path)
