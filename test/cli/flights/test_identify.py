"""``sysid identify``: the files it leaves, and one line for whatever is wrong."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest
from short_bags import short_bag

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.api import identify, load, replay
from sysid_node.batch.identify import METHODS
from sysid_node.cli.main import main
from sysid_node.errors import InputWarning
from sysid_node.flight.csv import write_csv
from sysid_node.flight.logs.opening import load_flight_record

ROOT = Path(__file__).resolve().parents[3]
BAGS = ROOT / "bags"
KEYS = {"aircraft", "method", "data_seconds", "samples", "rejected", "settings", "derivatives", "fits", "holdout"}


def arguments(out, *more, bag="cdrw_multistep", method="equation_error", aircraft="cdrw"):
    return ["identify", str(BAGS / bag), "--aircraft", str(aircraft), "--method", method, "--out", str(out), *more]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of a quiet identification with a flight held out; the flights are exact but for noise, and the file says so."""
    out = tmp_path_factory.mktemp("identify") / "out"
    file = out.parent / "cdrw.yaml"
    file.write_text("ideal: true\n" + (ROOT / "config" / "aircraft" / "cdrw.yaml").read_text())
    holdout = ["--holdout", str(BAGS / "cdrw_random"), "--set", "stepwise=true", "--quiet"]
    assert main(arguments(out, *holdout, aircraft=file)) == 0
    return out


@pytest.fixture(scope="module")
def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_the_summary_keeps_the_contract(summary):
    assert set(summary) >= KEYS
    assert summary["method"] == "equation_error"
    assert summary["data_seconds"] == pytest.approx(60.0, abs=0.5)
    assert set(summary["derivatives"]["Cm_alpha"]) >= {"value", "standard_error", "lower", "upper", "valid", "status"}
    assert set(summary["fits"]) == {"CL", "CD", "CY", "Cl", "Cm", "Cn"}
    assert summary["fits"]["Cm"]["r_squared"] > 0.98
    assert set(summary["holdout"]["cdrw_random"]) == {"CL", "CD", "CY", "Cl", "Cm", "Cn"}
    assert summary["settings"]["stepwise"] is True


@pytest.mark.slow
def test_what_is_odd_about_a_flight_is_in_the_report_as_well(tmp_path):
    """Truth: a mass in hundreds of grams, with which the mean lift is not that of the flight."""
    aircraft = load_aircraft("cdrw")
    (tmp_path / "heavy.yaml").write_text(dump_aircraft(replace(aircraft, mass=10.0 * aircraft.mass)))
    with pytest.warns(InputWarning, match="mean lift coefficient") as told:
        found = identify(load(short_bag("cdrw_random", 12.0, tmp_path), tmp_path / "heavy.yaml"), "equation_error")
    assert found.run.remarks[0] == str(told[0].message)


@pytest.mark.slow
def test_deflections_beyond_the_files_limits_are_warned_of(tmp_path):
    aircraft = load_aircraft("cdrw")
    controls = {name: replace(control, limit=0.01) for name, control in aircraft.controls.items()}
    (tmp_path / "small.yaml").write_text(dump_aircraft(replace(aircraft, controls=controls)))
    flight = load(short_bag("cdrw_random", 12.0, tmp_path), tmp_path / "small.yaml")
    for work in (replay, lambda flight: identify(flight, "equation_error")):
        with pytest.warns(InputWarning, match=r"elevator is deflected .* beside a limit of 0\.01 rad"):
            work(flight)


@pytest.mark.slow
def test_the_bundled_flights_truth_is_found(summary):
    truth = json.loads((BAGS / "cdrw_multistep.truth.json").read_text())["derivatives"]
    found = summary["derivatives"]
    assert set(found) == set(truth)
    for name in ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr"):
        assert found[name]["valid"]
        assert found[name]["value"] == pytest.approx(truth[name], rel=0.03), name


@pytest.mark.slow
def test_tolerances_servos_and_the_budget_are_those_of_the_contract(tmp_path):
    assert main(arguments(tmp_path / "out", "--quiet", bag=short_bag("cdrw_multistep", 36.0, tmp_path))) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    truth = json.loads((BAGS / "cdrw_multistep.truth.json").read_text())["derivatives"]
    for name, found in summary["derivatives"].items():
        parts = found["statistical_error"] ** 2 + found["systematic_error"] ** 2
        assert found["standard_error"] ** 2 == pytest.approx(parts), name
        assert found["systematic_error"] > 0.0, name
        assert found["lower"] <= truth[name] <= found["upper"], name
        assert summary["budget"][name], name
    assert set(summary["servos"]) == {"elevator", "aileron", "rudder"}
    assert {"value", "standard_error", "lower", "upper", "valid", "status"} <= set(summary["servos"]["rudder"])
    assert "Error budget" in (tmp_path / "out" / "report.html").read_text()


def test_the_tables_and_the_report_are_there(folder, summary):
    names = [row["name"] for row in rows(folder / "derivatives.csv")]
    assert names == list(summary["derivatives"])
    estimated = [name for name, d in summary["derivatives"].items() if d["value"] is not None]
    table = rows(folder / "correlation.csv")
    assert sorted(row[""] for row in table) == sorted(estimated)
    assert all(float(row[row[""]]) == pytest.approx(1.0) for row in table)
    assert {row["coefficient"] for row in rows(folder / "structure.csv")} == {"CL", "CD", "CY", "Cl", "Cm", "Cn"}
    assert {row["name"] for row in rows(folder / "noise.csv")} >= {"residual_CL", "residual_Cn"}
    report = (folder / "report.html").read_text()
    assert "Cm_alpha" in report or "C<sub>m" in report


@pytest.fixture
def short_log(tmp_path):
    """Ten seconds of a bundled flight."""
    write_csv(
        tmp_path / "short.csv", load_flight_record(BAGS / "cdrw_random", load_aircraft("cdrw")).between(2.0, 12.0)
    )
    return tmp_path / "short.csv"


@pytest.mark.slow
def test_a_rerun_leaves_no_table_of_the_run_before(tmp_path, short_log):
    out = tmp_path / "out"
    assert main(arguments(out, "--set", "stepwise=true", "--quiet", bag=short_log)) == 0
    assert (out / "structure.csv").exists()
    assert main(arguments(out, "--quiet", bag=short_log)) == 0
    assert not (out / "structure.csv").exists()


@pytest.mark.slow
def test_output_error_on_a_bag(tmp_path, capsys):
    """Pitch alone, in few samples, so that it is quick."""
    settings = ["--set", "states=alpha,q", "--set", "rate=25", "--set", "segment=10"]
    bag = short_bag("cdrw_random", 30.0, tmp_path)
    assert main(arguments(tmp_path / "out", *settings, method="output_error", bag=bag)) == 0
    said = capsys.readouterr().out
    assert "Cm_alpha" in said
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["derivatives"]["Cm_de"]["valid"]
    assert summary["derivatives"]["Cl_p"]["value"] is None
    assert summary["derivatives"]["Cl_p"]["status"] == "not part of the model that these flights allow"
    assert {"alpha", "q", "az"} <= set(summary["fits"])
    pieces = {row["piece"] for row in rows(tmp_path / "out" / "nuisance.csv")}
    assert pieces == {"0", "1", "2"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (["--set", "window=20"], "setting 'window' is not one of a batch method"),
        (["--set", "low_pas=20"], "did you mean 'low_pass'?"),
        (["--set", "low_pass=2", "--set", "low_pass=3"], "low_pass is given twice"),
        (["--frequencies", "0.1:0.1:1", "--set", "frequencies=0.1:0.1:2"], "both are given"),
        (["--set", "process_noise=2"], "'process_noise' is not used by frequency_equation_error"),
        (["--set", "segment=5"], "'segment' is not used by frequency_equation_error"),
        (["--set", "segment=1e-9", "--set", "correct_sensors=true"], "cannot be cut into segments of 1e-09 s"),
        (["--set", "segment"], "--set 'segment': expected KEY=VALUE"),
        (["--set", "states=alpha,speed"], "state 'speed' is not known"),
        (["--frequencies", "2:1"], "expected START:STEP:STOP in Hz"),
        (["--holdout", "nowhere.csv"], "nowhere.csv"),
    ],
)
def test_bad_input_is_one_line(tmp_path, capsys, change, said):
    method = "output_error" if "states=alpha,speed" in change else "frequency_equation_error"
    assert main(arguments(tmp_path / "out", *change, "--quiet", method=method, bag="cdrw_random")) == 2
    error = capsys.readouterr().err
    assert error.startswith("sysid identify: ")
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.parametrize("again", [[], ["--holdout"]], ids=["fitted", "held out"])
def test_a_flight_given_twice_is_refused(tmp_path, capsys, again):
    """Fitted twice it would make the intervals too narrow; held out it would check nothing."""
    flight = str(BAGS / "cdrw_multistep")
    fitted = ["identify", flight, *again, flight, "--aircraft", "cdrw", "--method", "equation_error"]
    assert main([*fitted, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "given twice" in error
    assert not (tmp_path / "out").exists()


def test_an_unknown_method_names_the_known_ones(tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(arguments(tmp_path / "out", method="kalman"))
    assert stopped.value.code == 2
    assert all(method in capsys.readouterr().err.replace("'", "") for method in METHODS[:1])


def test_a_flight_that_never_moves_gives_no_number_marked_valid(tmp_path):
    """A log at rest in the air: every regressor constant."""
    header = "t,ax,ay,az,p,q,r,phi,theta,V,alpha,beta,rho,thrust,de,da,dr"
    still = "0.8,0,-9.77,0,0,0,0,0.085,18,0.085,0,1.2,4.3,0,0,0"
    log = tmp_path / "still.csv"
    log.write_text("\n".join([header, *(f"{k / 50:.2f},{still}" for k in range(500))]) + "\n")
    out = tmp_path / "out"
    assert (
        main(["identify", str(log), "--aircraft", "cdrw", "--method", "equation_error", "--out", str(out), "--quiet"])
        == 0
    )
    found = json.loads((out / "summary.json").read_text())["derivatives"]
    assert not any(d["valid"] for name, d in found.items() if not name.endswith("_0"))
    assert all(d["status"] != "ok" for d in found.values() if not d["valid"])


@pytest.mark.slow
def test_a_kalman_filter_leaves_the_history_of_its_estimates(tmp_path):
    """One CLI run of a filter: two states at 20 Hz are enough for the files that it must leave."""
    out = tmp_path / "out"
    settings = ["--set", "states=alpha,q", "--set", "rate=20", "--set", "process_noise=0.5", "--quiet"]
    bag = short_bag("cdrw_multistep", 20.0, tmp_path)
    assert main(arguments(out, *settings, method="extended_kalman_filter", bag=bag)) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["settings"]["process_noise"] == 0.5
    history = [row for row in rows(out / "estimates.csv") if row["name"] == "Cm_de"]
    assert len(history) >= 19  # once a second
    errors = [float(row["statistical_error"]) for row in history]
    assert errors[-1] < 0.2 * errors[0]
    assert float(history[-1]["value"]) == pytest.approx(summary["derivatives"]["Cm_de"]["value"])
    noise = {row["name"] for row in rows(out / "noise.csv")}
    assert {"residual_q", "process_q", "sensor_q"} <= noise
