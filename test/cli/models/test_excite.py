"""``sysid excite``: its files, its page, its one line for bad input."""

import csv
import json
from html.parser import HTMLParser

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.logs.opening import load_flight_record

SPEC = "doublet:elevator:amplitude=0.03:start=1+doublet:rudder:amplitude=0.05:start=4"
FAST = ["--rate", "50", "--quiet"]


def sysid(*arguments):
    return main(["excite", *map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("excite") / "run"
    assert sysid("--aircraft", "cdfp", "--manoeuvre", SPEC, "--out", out, *FAST) == 0
    return out


@pytest.mark.slow
def test_the_table_is_the_manoeuvre(folder):
    with (folder / "manoeuvre.csv").open() as file:
        rows = list(csv.reader(file))
    aircraft = load_aircraft("cdfp")
    plan = parse_manoeuvre(SPEC, aircraft, 50.0)
    assert rows[0] == ["t", "elevator", "aileron", "rudder", "throttle"]
    table = np.array(rows[1:], dtype=float)
    assert np.array_equal(table[:, 0], plan.time)
    assert np.array_equal(table[:, 1:4], plan.surfaces())


@pytest.mark.slow
def test_the_summary_predicts_every_derivative(folder):
    found = json.loads((folder / "summary.json").read_text())
    assert found["manoeuvre"].startswith("doublet:elevator:amplitude=0.03")
    assert set(found["derivatives"]) == set(load_aircraft("cdfp").derivatives)
    errors = {name: d["standard_error"] for name, d in found["derivatives"].items()}
    assert all(error > 0 for error in errors.values())
    assert errors["Cm_de"] < 0.05 * abs(found["derivatives"]["Cm_de"]["value"])
    assert found["largest_deflections"] == {"elevator": 0.03, "rudder": 0.05}
    with (folder / "correlations.csv").open() as file:
        rows = list(csv.reader(file))
    matrix = np.array([row[1:] for row in rows[1:]], dtype=float)
    assert np.allclose(np.diag(matrix), 1.0)
    assert np.allclose(matrix, matrix.T)


@pytest.mark.slow
def test_the_bag_is_the_predicted_flight(folder):
    flight = load_flight_record(folder / "flight", load_aircraft("cdfp"))
    assert flight.duration > 7.5
    assert np.ptp(flight["de"]) > 0.05
    assert np.ptp(flight["q"]) > 0.1


class Links(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attributes):
        self.found += [value for name, value in attributes if name in ("src", "href") and tag != "a"]


@pytest.mark.slow
def test_the_page_is_whole_and_stands_alone(folder):
    page = (folder / "report.html").read_text()
    links = Links()
    links.feed(page)
    assert not [link for link in links.found if link.startswith(("http", "//"))]
    for name in load_aircraft("cdfp").derivatives:
        assert f"<code>{name}</code>" in page
    assert "Cramér" in page
    assert "doublet:rudder" in page


@pytest.mark.slow
def test_its_page_and_an_aircrafts_fit_every_width_light_and_dark(folder, tmp_path, fit_everywhere):
    assert main(["aircraft", "cdfp", "--out", str(tmp_path / "aircraft"), "--quiet"]) == 0
    fit_everywhere(folder / "report.html", tmp_path / "aircraft" / "report.html")


@pytest.mark.slow
def test_running_again_replaces(folder):
    assert sysid("--aircraft", "cdfp", "--manoeuvre", SPEC, "--out", folder, "--open-loop", *FAST) == 0
    assert json.loads((folder / "summary.json").read_text())["autopilot"] is False


def test_optimising_lowers_the_error(tmp_path, capsys):
    arguments = ["--aircraft", "cdfp", "--manoeuvre", SPEC, "--out", tmp_path / "best", "--optimise"]
    assert sysid(*arguments, "--evaluations", 25, "--envelope", "bank=0.5", "--rate", 50) == 0
    found = json.loads((tmp_path / "best" / "summary.json").read_text())["optimisation"]
    assert found["left_best"] < found["left_start"]
    page = (tmp_path / "best" / "report.html").read_text()
    assert "Initial manoeuvre" in page
    assert found["start"] in page
    assert str(tmp_path / "best" / "report.html") in capsys.readouterr().out


def test_a_control_alone_leaves_the_other_axis_unknown(tmp_path, capsys):
    pulse = ["--manoeuvre", "pulse:elevator:amplitude=0.02", "--rate", "50"]
    assert sysid("--aircraft", "cdrw", *pulse, "--out", tmp_path) == 0
    found = json.loads((tmp_path / "summary.json").read_text())["derivatives"]
    assert found["Cl_p"]["standard_error"] is None
    assert found["Cm_de"]["standard_error"] > 0
    (said,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("It tells hardly more than"))
    assert "Cl_p" in said
    assert "Cm_de" not in said
    assert "22 of" not in (tmp_path / "report.html").read_text()


def test_a_flight_that_leaves_the_envelope_is_said(tmp_path, capsys):
    """The page's words; the departure in angle of attack is predicted anew here."""
    large = "doublet:elevator:amplitude=0.2"
    assert sysid("--aircraft", "cdrw", "--manoeuvre", large, "--out", tmp_path / "a", "--rate", "50") == 0
    said = capsys.readouterr().out.splitlines()[1]
    flown = load_flight_record(tmp_path / "a" / "flight", load_aircraft("cdrw"))
    share = 100.0 * np.abs(flown["alpha"] - flown["alpha"][0]).max() / 0.1
    assert said.startswith("The flight exceeds the envelope in angle of attack (")
    assert float(said.partition("(")[2].partition("\u202f")[0]) == pytest.approx(share, rel=0.02)
    assert sysid("--aircraft", "cdrw", "--manoeuvre", SPEC, "--out", tmp_path / "b", "--rate", "50") == 0
    assert "envelope" not in capsys.readouterr().out


MISTAKES = [
    (["--aircraft", "cdrv"], "aircraft 'cdrv' is not known"),
    (["--manoeuvre", "doublet:flap:amplitude=0.1"], "cdrw has no control 'flap'"),
    (["--manoeuvre", "doublet:elevator:amplitude=0.5"], "lower the amplitude"),
    (["--airspeed", "2"], "no steady flight at 2 m/s"),
    (["--evaluations", "1"], "--evaluations 1: expected 10 to 10000"),
    (["--evaluations", "50"], "--evaluations 50: nothing is optimised; give --optimise, or leave it out"),
    (["--manoeuvre", "3211:throttle:amplitude=0.2"], "throttle reaches -0.05616 at 2.50 s, but cdrw allows 0 to 1"),
    (["--manoeuvre", "3211:elevator:width=0.001"], "steps of 0.001 s cannot be drawn at 100 Hz"),
    (["--envelope", "alfa=1"], "did you mean 'alpha'?"),
    (["--envelope", "alpha=-1"], "expected alpha=VALUE, above zero"),
    (["--rate", "0.1"], "expected 1 to 10000 Hz"),
    (["--duration", "nan"], "nan s at"),
    (["--duration", "1"], "but the flight 1 s"),
]


@pytest.mark.parametrize(("change", "expected"), MISTAKES, ids=[" ".join(change) for change, _ in MISTAKES])
def test_bad_input_is_one_line_and_exit_2(tmp_path, capsys, change, expected):
    given = {"--aircraft": "cdrw", "--manoeuvre": SPEC, "--out": str(tmp_path / "x")}
    given |= dict([change])
    assert sysid(*[word for pair in given.items() for word in pair], "--quiet") == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert expected in message
    assert not (tmp_path / "x").exists()


def test_a_folder_that_is_a_file_is_an_error(tmp_path, capsys):
    (tmp_path / "x").write_text("")
    arguments = ["--aircraft", "cdfp", "--manoeuvre", SPEC, "--out", tmp_path / "x", *FAST]
    assert sysid(*arguments) == 2
    assert "cannot be written" in capsys.readouterr().err
