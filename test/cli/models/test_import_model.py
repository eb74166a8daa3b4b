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
        "# Written by sysid import --format rosflight from x8; rm -rf.yaml.\n# - Deflections"
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
