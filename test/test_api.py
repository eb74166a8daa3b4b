"""The Python interface: five lines from a bag to a figure, and the same files as the commands write."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from short_bags import short_bag

import sysid_node
from sysid_node import diagnose, identify, load, replay
from sysid_node.cli.main import main
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.csv import write_csv

ROOT = Path(__file__).resolve().parents[1]
BAG = ROOT / "bags" / "cdrw_multistep"
TRUTH = json.loads((ROOT / "bags" / "cdrw_multistep.truth.json").read_text())["derivatives"]


def identify_simply(flight):
    return identify(flight, "equation_error")


@pytest.fixture(scope="module")
def flight():
    return load(BAG, "cdrw")


@pytest.fixture(scope="module")
def replayed(tmp_path_factory):
    flight = load(short_bag("cdrw_multistep", 36.0, tmp_path_factory.mktemp("replayed")), "cdrw")
    return replay(flight, {"publish_rate": 1.0})


@pytest.fixture(scope="module")
def log(flight, tmp_path_factory):
    """The first 16 s of the flight, as CSV."""
    path = tmp_path_factory.mktemp("log") / "short.csv"
    write_csv(path, flight.record.between(0.0, 16.0))
    return path


@pytest.fixture(scope="module")
def identified(log):
    return identify(load(log, "cdrw"), "equation_error")


def test_the_package_alone_is_light():
    """`import sysid_node` loads no library, and the online path no report."""
    code = "import sys, sysid_node; print([m for m in ('numpy', 'jax', 'jinja2', 'plotly') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_only_what_is_documented_is_offered():
    assert sysid_node.__all__ == ["diagnose", "identify", "load", "replay"]
    with pytest.raises(AttributeError, match="has no attribute 'fly'"):
        _ = sysid_node.fly


def test_a_flight_says_what_it_holds(flight):
    assert repr(flight).startswith("cdrw_multistep of cdrw: 60.0 s, ")
    assert "alpha" in repr(flight)
    assert {axis.title.text for axis in flight.plot().select_yaxes()} >= {"deg", "deg/s", "m/s"}


@pytest.mark.slow
def test_a_replay_finds_the_truth_and_prints_it(replayed):
    """The truth of a simulated flight lies in most 95 % intervals (27 of them; five misses have odds of 1 in 100)."""
    valid = [d for d in replayed.derivatives.values() if d.valid]
    missed = [d.name for d in valid if not d.lower <= TRUTH[d.name] <= d.upper]
    assert len(valid) > 20
    assert len(missed) < 5
    assert "derivatives are known well enough to use" in repr(replayed)
    assert re.search(r"Cm_alpha +−0\.\d+ ± 0\.\d+ per rad +ok", repr(replayed))
    assert "<table>" in replayed._repr_html_()


@pytest.mark.slow
def test_a_figure_shows_the_estimates_as_the_report_does(replayed):
    """One panel a derivative, whose last line is the estimate against time."""
    figure = replayed.plot()
    names = [note.text for note in figure.layout.annotations]
    assert len(names) == len(replayed.derivatives)
    place = names.index("Cm_alpha") + 1
    line = [trace for trace in figure.data if trace.xaxis == f"x{place}"][-1]
    drawn = np.asarray(line.y, dtype=float)
    assert drawn[-1] == pytest.approx(replayed.derivatives["Cm_alpha"].value, rel=1e-6)


@pytest.mark.slow
def test_an_identification_draws_its_fit_by_default(identified):
    found = identified.derivatives["Cm_alpha"]
    assert found.valid and found.lower <= TRUTH["Cm_alpha"] <= found.upper
    assert [trace.name for trace in identified.plot().data[:2]] == ["measured", "model"]
    with pytest.raises(InputError, match="this result has fit, excitation, residuals"):
        identified.plot("estimates")


@pytest.mark.slow
@pytest.mark.parametrize("command", [["replay", "--set", "publish_rate=1"], ["identify", "--method", "equation_error"]])
def test_what_is_saved_is_what_the_command_writes(command, log, identified, tmp_path):
    name, *options = command
    assert main([name, str(log), "--aircraft", "cdrw", "--out", str(tmp_path / "command"), "--quiet", *options]) == 0
    result = identified if name == "identify" else replay(load(log, "cdrw"), {"publish_rate": 1.0})
    assert result.save(tmp_path / "api") == tmp_path / "api" / "report.html"
    written, expected = ({p.name for p in (tmp_path / f).iterdir()} for f in ("api", "command"))
    assert written == expected
    for file in (p for p in (tmp_path / "command").iterdir() if p.is_file()):
        assert (tmp_path / "api" / file.name).read_bytes() == file.read_bytes(), file.name


@pytest.mark.slow
def test_a_smooth_flight_held_out_is_read_as_the_commands_that_it_holds(tmp_path):
    """Steps show commands, a multisine does not; both flights were recorded alike, with servos of 0.1 s."""
    for name, manoeuvre in (("steps", "3211"), ("smooth", "multisine")):
        words = ["--manoeuvre", manoeuvre, "--effect", "actuator_lag:time_constant=0.1", "--out", str(tmp_path / name)]
        assert main(["simulate", "--aircraft", "cdrw", "--seed", "1", *words, "--quiet"]) == 0
    steps, smooth = (load(tmp_path / name, "cdrw") for name in ("steps", "smooth"))
    assert (steps.record.commanded, smooth.record.commanded) == (True, False)
    held_out = identify(steps, "equation_error", holdout=[smooth]).run.holdout["smooth"]
    assert min(held_out["Cl"]["r_squared"], held_out["Cm"]["r_squared"]) > 0.95  # below zero as positions


@pytest.mark.slow
def test_offsets_are_not_excited_where_a_control_does_not_move(flight, tmp_path):
    """An elevator that stays where it is cannot be told from an offset."""
    record = flight.record.between(0.0, 24.0)
    columns = {**record.columns, "de": np.full(len(record), 0.02)}
    write_csv(tmp_path / "still.csv", replace(record, columns=columns))
    found = replay(load(tmp_path / "still.csv", "cdrw"), {"publish_rate": 1.0}).final.derivatives
    assert {found[name].status for name in ("CL_0", "CL_de", "Cm_0", "Cm_de")} == {"not excited"}
    assert found["Cl_p"].valid


@pytest.mark.slow
@pytest.mark.parametrize("work", [identify_simply, replay])
def test_a_surface_that_is_counted_the_other_way_is_said(flight, tmp_path, work):
    record = flight.record.between(0.0, 30.0)
    write_csv(tmp_path / "other.csv", replace(record, columns={**record.columns, "de": -record["de"]}))
    with pytest.warns(InputWarning, match=r"Cm_de is 0\.\d+, .* is elevator counted the other way"):
        found = work(load(tmp_path / "other.csv", "cdrw"))
    assert any("counted the other way" in remark for remark in found.run.remarks)


def test_a_gap_is_not_asked_for_with_a_surface_that_is_counted_the_other_way(flight, tmp_path, capsys):
    """Neither as a real nor as a simulated flight; `sysid check` says so before."""
    record = flight.record.between(0.0, 30.0)
    other = tmp_path / "other.csv"
    write_csv(other, replace(record, columns={**record.columns, "de": -record["de"]}))
    turned, told = load(other, "cdrw"), r"other\.csv: Cm_de is 0\.\d+, .* is elevator counted the other way"
    for flights, simulated in ((turned, ()), (load(BAG, "cdrw"), turned)):
        with pytest.raises(InputError, match=told):
            diagnose(flights, simulated=simulated)
    assert main(["check", str(other), "--aircraft", "cdrw"]) == 0
    assert "gap: no: Cm_de is 0." in " ".join(capsys.readouterr().out.split())


def test_without_pandas_one_line_says_so(replayed, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="to_pandas needs pandas, which is not installed: pip install pandas"):
        replayed.to_pandas()


def test_a_table_for_pandas(replayed, flight):
    pytest.importorskip("pandas")
    table = replayed.to_pandas()
    assert table.loc["Cm_alpha", "value"] == replayed.derivatives["Cm_alpha"].value
    assert len(flight.to_pandas()) == len(flight.record)


@pytest.mark.parametrize(
    ("work", "said"),
    [
        (lambda: load(BAG, "nonesuch"), "aircraft 'nonesuch' is not known"),
        (lambda: load(BAG, "cdrw", topics=["imu:=x"]), "'imu' is none of imu/data"),
        (lambda: replay(load(BAG, "cdrw"), {"windoww": 3}), "'windoww' is not known"),
        (lambda: identify([], "equation_error"), "no flight to identify from"),
        (lambda: identify(load("nowhere.csv", "cdrw"), "equation_error"), "nowhere.csv"),
        (lambda: load(BAG, "cdrw", body_frame="FRD"), "body_frame = 'FRD': expected one of flu, frd"),
        (lambda: load([BAG], "cdrw"), "expected the path of one bag or log"),
        (lambda: replay(str(BAG)), "expected what load(path, aircraft) returns"),
        (lambda: replay([load(BAG, "cdrw"), load(BAG, "cdrw")]), "flight: got 2 flights, expected one"),
        (lambda: identify([load(BAG, "cdrw"), BAG], "equation_error"), "flights: got"),
        (lambda: identify(load(BAG, "cdrw"), "equation_error", holdout=str(BAG)), "holdout: got"),
        (lambda: identify(load(BAG, "cdrw"), None), "method None: expected one of equation_error"),
        (lambda: diagnose(load(BAG, "cdrw"), simulated=str(BAG)), "simulated: got"),
        (lambda: identify(load(BAG, "cdrw"), "equation_error", {"stepwise": None}), "expected a bool"),
        (lambda: replay(load(BAG, "cdrw"), {"window": True}), "setting window = True: expected a float"),
        (
            lambda: identify([load(BAG, "cdrw"), load(BAG, "kestrel")], "equation_error"),
            "were loaded with different aircraft files (cdrw and kestrel)",
        ),
    ],
)
def test_mistakes_are_one_line(work, said):
    with pytest.raises(InputError, match=re.escape(said)):
        work()


_PROGRAMS = """
import jax, numpy as np
from sysid_node.api.compiled_programs import release_compiled_programs
doubled = jax.jit(lambda x: 2.0 * x)
print(float(doubled(np.ones(7))[0]), release_compiled_programs(share=1.0), doubled._cache_size())
print(release_compiled_programs(share=0.0), doubled._cache_size(), float(doubled(np.ones(7))[0]))
"""


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="the system does not count a process's memory maps")
def test_programs_are_given_up_where_a_process_has_too_many():
    """JAX keeps what it compiles in memory maps, of which Linux allows a process only so many."""
    said = subprocess.run([sys.executable, "-c", _PROGRAMS], capture_output=True, text=True, check=True).stdout
    assert said.split() == ["2.0", "False", "1", "True", "0", "2.0"]


def test_nothing_is_given_up_where_nothing_was_compiled():
    words = "from sysid_node.api.compiled_programs import release_compiled_programs as r; import sys; "
    words += "print(r(share=0.0), 'jax' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True).stdout
    assert said.split() == ["False", "False"]
