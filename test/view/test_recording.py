"""What ``sysid view --save`` writes, read back from the file and held against the run."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import synthetic
from rrd import Recorded

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import BAD_INPUT, DONE, main
from sysid_node.csv_table import write_table
from sysid_node.faults.recorded_flight import Episode, FaultVerdict
from sysid_node.faults.types import LOSS, Fault
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.flight.record import FlightRecord
from sysid_node.report.files.loop_folder import write_loop_folder
from sysid_node.report.files.runs.run_folder import write_run
from sysid_node.report.results.closed_loop import ClosedLoopFlight, Event
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.results.signals import Response, RunSignals

DEGREES = 180.0 / math.pi


def circle(seconds: float = 12.0, rate: float = 100.0) -> FlightRecord:
    """A level circle at 20 m/s and 0.2 rad/s, banked by 0.3 rad, with a second of elevator at 4 s."""
    time = np.arange(0.0, seconds, 1.0 / rate)
    same = np.ones_like(time)
    columns = {
        "ax": 0 * same, "ay": 0 * same, "az": -9.8 * same, "p": 0 * same, "q": 0 * same, "r": 0.2 * same,
        "phi": 0.3 * same, "theta": 0 * same, "psi": 0.2 * time, "V": 20.0 * same, "alpha": 0 * same,
        "beta": 0 * same, "rho": 1.2 * same, "thrust": 5 * same, "de": np.where((time >= 4) & (time < 5), 0.1, 0.0),
        "da": 0 * same, "dr": 0 * same,
    }  # fmt: skip
    return FlightRecord(time, columns, "circle", 1_000_000_000)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunResult, Recorded]:
    """A synthetic run with a flown circle and a fault, and its file."""
    folder = tmp_path_factory.mktemp("run")
    flight, made = circle(), synthetic.run(seconds=12.0, publish_rate=2.0)
    time = np.arange(0.0, 11.9, 0.1)
    response = Response("", time, np.full_like(time, 0.5), np.full_like(time, 0.4))
    fault = Fault(LOSS, "elevator", 0.5, 0.4, 0.6, "1", 6.0, 8.0, 0.99)
    run = RunResult(
        aircraft="cdrw",
        method=made.method,
        history=made.history,
        references=made.references,
        signals=RunSignals(flight, responses={"CL": response}),
        faults=FaultVerdict(10.0, episodes=[Episode(fault, 11.0)]),
    )
    write_run(folder, run)
    path = folder / "flight.rrd"
    assert main(["view", str(folder), "--save", str(path), "--quiet"]) == DONE
    return run, Recorded(path)


def test_everything_lies_on_the_time_of_the_flight(saved: tuple[RunResult, Recorded]) -> None:
    _, recorded = saved
    assert recorded.applications == {"sysid"}
    assert recorded.blueprints == 1
    assert "flight" in recorded.timelines
    times = [time for (entity, _), (time, _) in recorded.values.items() if time is not None and entity != "/about"]
    assert all(time.min() >= -0.001 and time.max() <= 12.0 for time in times)


def test_estimates_are_those_of_the_run(saved: tuple[RunResult, Recorded]) -> None:
    run, recorded = saved
    history = [e for e in run.history if e.derivatives]
    for name, tab in (("Cm_alpha", "derivatives_pitch"), ("Cl_p", "derivatives_roll_and_yaw")):
        expected = [e.derivatives[name] for e in history]
        time, lower = recorded.curve(f"/{tab}/{name}/lower_95")
        np.testing.assert_allclose(time, [e.time for e in history], atol=1e-9)
        np.testing.assert_array_equal(lower, [d.lower for d in expected])
        _, shown = recorded.curve(f"/{tab}/{name}/estimate")
        np.testing.assert_array_equal(shown, [d.value if d.valid else math.nan for d in expected])
        _, file = recorded.curve(f"/{tab}/{name}/aircraft_file")
        assert set(file) == {run.references.prior[name].value}
        assert set(recorded.curve(f"/{tab}/{name}/true")[1]) == {run.references.truth[name]}


def test_motion_is_shown_in_degrees(saved: tuple[RunResult, Recorded]) -> None:
    run, recorded = saved
    time, bank = recorded.curve("/flight/attitude/roll")
    np.testing.assert_allclose(bank, 0.3 * DEGREES)
    np.testing.assert_allclose(time, run.signals.flight.time, atol=1e-9)
    np.testing.assert_allclose(recorded.curve("/flight/controls/elevator")[1].max(), 0.1 * DEGREES)


def test_the_way_of_a_circle_is_a_circle(saved: tuple[RunResult, Recorded]) -> None:
    """Analytic: at 20 m/s and 0.2 rad/s the radius is 100 m, its centre 100 m to the right of the start."""
    _, recorded = saved
    time, position = recorded.vectors("/world/measured", "translation")
    expected = 100.0 * np.column_stack([np.sin(0.2 * time), 1.0 - np.cos(0.2 * time), np.zeros_like(time)])
    np.testing.assert_allclose(position, expected, atol=2e-3)


def test_the_aircraft_is_banked_and_heads_along_its_way(saved: tuple[RunResult, Recorded]) -> None:
    """The quaternion (x, y, z, w) of roll 0.3 and heading 0.2 t, written out: roll about x, then heading about z."""
    _, recorded = saved
    time, turned = recorded.vectors("/world/measured/body", "quaternion")
    half_roll, half_heading = 0.15, 0.1 * time
    expected = np.column_stack(
        [
            np.sin(half_roll) * np.cos(half_heading),
            np.sin(half_roll) * np.sin(half_heading),
            np.cos(half_roll) * np.sin(half_heading),
            np.cos(half_roll) * np.cos(half_heading),
        ]
    )
    np.testing.assert_allclose(turned, expected, atol=1e-6)


def test_the_missing_force_points_up_where_lift_is_missing(saved: tuple[RunResult, Recorded]) -> None:
    """0.1 of CL at 20 m/s, 1.2 kg/m^3 and the file's 0.7875 m^2 is 18.9 N, up: minus z."""
    _, recorded = saved
    _, arrow = recorded.vectors("/world/measured/body/missing_force", "vectors")
    assert np.all(arrow[:, 2] < 0.0)
    np.testing.assert_allclose(arrow[:, :2], 0.0, atol=1e-6)
    words = recorded.texts("/about", "text")[0]
    newtons = float(words.partition("1 m of its arrow is ")[2].split()[0])
    np.testing.assert_allclose(-arrow[:, 2] * newtons, 0.1 * 0.5 * 1.2 * 400 * 0.7875, rtol=0.01)


def test_manoeuvre_and_fault_are_marked(saved: tuple[RunResult, Recorded]) -> None:
    _, recorded = saved
    time, _ = recorded.values["/lanes/elevator", "state"]
    assert recorded.texts("/lanes/elevator", "state") == ["nothing", "moves", "nothing"]
    np.testing.assert_allclose(time, [0.0, 4.0, 5.0], atol=0.15)
    assert recorded.texts("/lanes/fault_elevator", "state") == ["nothing", LOSS, "nothing"]
    assert recorded.values["/lanes/fault_elevator", "state"][0].tolist() == [0.0, 6.0, 11.0]
    assert any("fault found: elevator" in text for text in recorded.texts("/notes", "text"))


def test_a_bag_is_shown_without_a_run(tmp_path: Path) -> None:
    aircraft = load_aircraft("cdrw")
    write_streams(tmp_path / "bag", streams_from_record(circle(), aircraft))
    command = ["view", str(tmp_path / "bag"), "--save", str(tmp_path / "bag.rrd"), "--quiet"]
    assert main([*command, "--aircraft", "cdrw"]) == DONE
    recorded = Recorded(tmp_path / "bag.rrd")
    np.testing.assert_allclose(recorded.curve("/flight/airspeed/airspeed")[1], 20.0)
    assert {"/world/measured", "/world/measured/body", "/world/way_measured"} <= recorded.entities
    assert main(command) == BAD_INPUT  # whose bag it is must be said


def test_a_gap_is_shown_as_measured_and_as_simulated(tmp_path: Path) -> None:
    time = np.arange(0.0, 6.0, 0.02)
    zero = np.zeros_like(time)
    columns = {"flight": zero, "time": time, "begins": (np.arange(time.size) % 100 == 0).astype(float)}
    for stage, bank in (("measured", 0.1), ("file", 0.4), ("corrected", 0.12)):
        columns |= {f"{stage}_{n}": zero for n in ("ax", "ay", "az", "p", "q", "r", "theta", "psi", "alpha", "beta")}
        columns |= {f"{stage}_phi": zero + bank, f"{stage}_V": zero + (20.0 if stage != "file" else 22.0)}
    columns |= {"command_elevator": 0.1 * np.sin(time), "rho": zero + 1.2}
    for stage, size in (("missing_file", 0.2), ("missing_corrected", 0.02)):
        columns |= {
            f"{stage}_{c}": size * np.sin(3 * time) if c == "CL" else zero for c in ("CL", "CD", "CY", "Cl", "Cm", "Cn")
        }
    folder = tmp_path / "a_flight_of_a_fleet" / "gap"
    folder.mkdir(parents=True)
    write_table(folder / "flights.csv", list(columns), zip(*columns.values(), strict=True))
    gap = {"before": 0.5, "after": 0.1, "noise_floor": 0.1}
    content = {"verdict": "explained", "aircraft": "cdrw", "gap": gap, "causes": [{"label": "stall_separation"}]}
    (folder / "gap.json").write_text(json.dumps(content))
    assert main(["view", str(folder.parent), "--save", str(tmp_path / "gap.rrd"), "--quiet"]) == DONE
    recorded = Recorded(tmp_path / "gap.rrd")
    for body in ("measured", "simulated_aircraft_file", "simulated_corrected"):
        assert f"/world/{body}/body/airframe" in recorded.entities
    shown, roll = recorded.curve("/flown_and_simulated/roll/simulated_aircraft_file")
    np.testing.assert_allclose(shown, time, atol=1e-9)
    np.testing.assert_allclose(roll[~np.isnan(roll)], 0.4 * DEGREES)
    assert np.isnan(roll[::100]).all()  # where the simulator starts again
    _, measured = recorded.vectors("/world/measured", "translation")
    _, simulated = recorded.vectors("/world/simulated_aircraft_file", "translation")
    ahead = (simulated - measured)[:, 0]
    np.testing.assert_allclose(ahead[::100], 0.0, atol=1e-6)
    np.testing.assert_allclose(ahead[99], 2.0 * time[99], rtol=1e-6)  # 2 m/s faster since it began
    before, after = (
        recorded.vectors(f"/world/measured/body/missing_force{end}", "vectors")[1] for end in ("", "_corrected")
    )
    np.testing.assert_allclose(after, 0.1 * before, atol=1e-6)


def test_of_a_whole_fleet_one_flight_must_be_chosen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "fleet.json").write_text("{}")
    assert main(["view", str(tmp_path), "--save", str(tmp_path / "fleet.rrd")]) == BAD_INPUT
    assert "give the folder of one flight" in capsys.readouterr().err


def test_a_closed_loop_is_shown(tmp_path: Path) -> None:
    time = np.arange(0.0, 40.0, 0.1).tolist()
    flight = ClosedLoopFlight(
        aircraft="cdrw",
        failure="control_effectiveness_loss:elevator=0.6",
        onset=30.0,
        adapted=True,
        time=time,
        errors={"pitch": [0.01] * 400, "roll": [0.02] * 400, "sideslip": [0.0] * 400},
        commanded={"pitch": [0.1] * 400, "roll": [0.2] * 400},
        estimates={},
        events=[
            Event(3.0, "exciter", "begun"),
            Event(9.0, "exciter", "known"),
            Event(33.0, "fault_monitor", "elevator: lost"),
        ],
        troubles={},
    )
    write_loop_folder(tmp_path, flight)
    assert main(["view", str(tmp_path), "--save", str(tmp_path / "loop.rrd"), "--quiet"]) == DONE
    recorded = Recorded(tmp_path / "loop.rrd")
    np.testing.assert_allclose(recorded.curve("/tracking/roll/flown")[1], 0.22 * DEGREES)
    assert recorded.values["/lanes/exciter", "state"][0].tolist() == [0.0, 3.0, 9.0]
    assert recorded.texts("/lanes/failure", "state") == ["nothing", flight.failure]
    assert recorded.texts("/notes", "level") == ["INFO", "INFO", "ERROR"]


def test_another_file_is_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "run").mkdir()
    write_run(tmp_path / "run", synthetic.run(seconds=12.0))
    taken = tmp_path / "mine.rrd"
    for name, content, complaint in (
        ("notes.txt", None, "ends in .rrd"),
        ("mine.rrd", "my notes", "holds something else"),
        ("nowhere/a.rrd", None, "no place for a file"),
    ):
        if content:
            taken.write_text(content)
        assert main(["view", str(tmp_path / "run"), "--save", str(tmp_path / name)]) == BAD_INPUT
        assert complaint in capsys.readouterr().err
    assert taken.read_text() == "my notes"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mine.rrd", "run"]


@pytest.mark.parametrize("command", ["replay", "report", "gap", "view"])
def test_other_commands_do_not_load_the_viewer(command: str) -> None:
    code = f"import sys, sysid_node.cli.flights.{command}; print('rerun' in sys.modules, 'pyarrow' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_what_cannot_be_shown_says_what_can(tmp_path, capsys):
    for name, content in (("manoeuvre", '{"manoeuvre": "3211"}'), ("run", '{"aircraft": "cdrw", "method": "iv_rft"}')):
        (tmp_path / name).mkdir()
        (tmp_path / name / "summary.json").write_text(content)
    for words, said in (
        (["absent"], "absent: does not exist; give a folder that a command wrote, or a bag or log"),
        (["manoeuvre"], f"show its predicted flight: {tmp_path / 'manoeuvre' / 'flight'} with --aircraft FILE|NAME"),
        (["run", "--topic", "imu/data:=/imu"], "run: is a run, to which --topic and --body-frame do nothing"),
        (["run", "--body-frame", "frd"], "run: is a run, to which --topic and --body-frame do nothing"),
    ):
        path = str(tmp_path / words[0])
        assert main(["view", path, *words[1:], "--save", str(tmp_path / "x.rrd")]) == BAD_INPUT
        error = capsys.readouterr().err
        assert said in error
        assert len(error.splitlines()) == 1
