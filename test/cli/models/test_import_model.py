"""``sysid import``: what it writes, what it refuses."""

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main

PARAMETERS = """/**:
  ros__parameters: {rho: 1.2, mass: 2.0, wing_s: 0.4, wing_b: 1.6, wing_c: 0.25, wing_M: 50.0, wing_alpha0: 0.4,
    Jxx: 1.229, Jyy: 0.17, Jzz: 0.8, C_L_O: 0.2, C_L_alpha: 5.0, C_D_p: 0.03, C_m_O: 0.02, C_m_alpha: -0.9,
    C_m_q: -12.0, C_m_delta_e: -0.6, C_ell_p: -0.5, C_ell_delta_a: 0.12, C_n_beta: 0.07, C_n_r: -0.1,
    C_n_delta_r: -0.06, C_ell_beta: -0.05, C_Y_beta: -0.4}
"""


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "x8; rm -rf.yaml"  # a name with odd characters is a name
    path.write_text(PARAMETERS)
    return path


def run(model, out, *more):
    return main(["import", str(model), "--format", "rosflight", "--out", str(out), *more])


def test_the_file_loads_and_says_what_it_does_not_hold(model, tmp_path, capsys):
    out = tmp_path / "x8.yaml"
    assert run(model, out) == 0
    said = capsys.readouterr()
    assert "- The file has no propeller and motor" in said.out
    assert "no rigid body has Ixx" in said.err  # a warning: a simulator flies with it
    assert out.read_text().startswith(
        "# Written by sysid import --format rosflight from x8; rm -rf.yaml.\n# - Missing coefficients"
    )
    with pytest.warns(UserWarning, match="no rigid body"):
        aircraft = load_aircraft(out)
    assert aircraft.ideal
    assert aircraft.derivatives["Cm_alpha"].value == pytest.approx(-0.9)


def test_airspeed_is_that_of_the_level_flight(model, tmp_path):
    assert run(model, tmp_path / "a.yaml", "--airspeed", "16.5", "--quiet") == 0
    with pytest.warns(UserWarning, match="no rigid body"):
        assert load_aircraft(tmp_path / "a.yaml").reference.airspeed == 16.5


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--airspeed", "0.1"], "expected 1 to 1000 m/s"),
        (["--altitude", "500"], "one air density at every height"),
        (["--airspeed", "300"], "no level flight at 300.0 m/s"),
    ],
)
def test_bad_options_are_one_line(model, tmp_path, capsys, more, said):
    assert run(model, tmp_path / "a.yaml", *more) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "a.yaml").exists()


def test_neither_the_model_nor_another_file_is_overwritten(model, tmp_path, capsys):
    assert run(model, model, "--force") == 2
    assert "is the input" in capsys.readouterr().err
    assert model.read_text() == PARAMETERS
    other = tmp_path / "notes.yaml"
    other.write_text("mine")
    assert run(model, other) == 2
    assert other.read_text() == "mine"
    assert run(model, other, "--force", "--quiet") == 0
    assert run(model, other, "--quiet") == 0  # its own earlier file


@pytest.mark.parametrize(
    ("was", "is_now", "said"),
    [
        ("mass: 2.0", "mass: -2.0", "mass is -2; it must be above zero"),
        ("wing_s: 0.4", "wing_s: 0.0", "wing_s is 0; it must be above zero"),
        ("rho: 1.2", "rho: 3.0", "no aircraft file can hold it: reference.air_density: got 3.0, expected"),
    ],
)
def test_a_wrong_number_names_the_model_and_not_the_file_to_be(model, tmp_path, capsys, was, is_now, said):
    model.write_text(PARAMETERS.replace("Jxx: 1.229", "Jxx: 0.7").replace(was, is_now))
    assert run(model, tmp_path / "a.yaml", "--airspeed", "16") == 2
    message = capsys.readouterr().err
    assert message.startswith(f"sysid import: {model}: {said}")
    assert message.count("\n") == 1


def test_sizes_that_do_not_go_together_are_a_warning_in_a_simulators_file(model, tmp_path, capsys):
    """S is four times b cbar: JSBSim's minisgs has such sizes, and flies by them."""
    model.write_text(PARAMETERS.replace("wing_s: 0.4", "wing_s: 1.6"))
    assert run(model, tmp_path / "a.yaml") == 0
    assert "S = 1.6 m^2 does not go with b cbar = 0.4 m^2; check the units; they are taken" in capsys.readouterr().err


def test_all_airspeeds_that_were_tried_are_named(model, tmp_path, capsys):
    model.write_text(PARAMETERS.replace("C_m_O: 0.02", "C_m_O: 9.0"))
    assert run(model, tmp_path / "a.yaml") == 2
    assert "no level flight at 9.5 or 11.7 or 14.3 or 18.1 or 23.3 m/s that" in capsys.readouterr().err
