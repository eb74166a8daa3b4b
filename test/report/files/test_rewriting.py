"""The report of any folder, written again from the folder's files."""

from pathlib import Path

import pytest
import synthetic

from sysid_node.errors import InputError
from sysid_node.report.files.loop_folder import write_loop_folder
from sysid_node.report.files.rewriting import rewrite_report
from sysid_node.report.files.runs.run_folder import write_run
from sysid_node.report.results.closed_loop import ClosedLoopFlight, Event


def loop_flight() -> ClosedLoopFlight:
    """Forty seconds with a failure at thirty."""
    time = [0.1 * i for i in range(400)]
    errors = {axis: [0.01 * (i % 7) for i in range(400)] for axis in ("pitch", "roll", "sideslip")}
    commanded = {axis: [0.1] * 400 for axis in ("pitch", "roll")}
    events = [Event(3.0, "exciter", "begun"), Event(33.0, "fault_monitor", "elevator: lost")]
    return ClosedLoopFlight("cdrw", "stuck_surface:elevator=1", 30.0, True, time, errors, commanded, {}, events, {})


def test_a_closed_loop_reads_as_it_was_written(tmp_path: Path) -> None:
    write_loop_folder(tmp_path, loop_flight())
    before = (tmp_path / "report.html").read_text()
    (tmp_path / "report.html").unlink()
    assert rewrite_report(tmp_path).read_text() == before


def test_a_run_reads_as_it_was_written(tmp_path: Path) -> None:
    write_run(tmp_path, synthetic.run(seconds=12.0))
    before = (tmp_path / "report.html").read_text()
    (tmp_path / "report.html").unlink()
    assert rewrite_report(tmp_path).read_text() == before


@pytest.mark.parametrize("command", ["gap", "aircraft", "fleet"])
def test_what_its_files_do_not_hold_names_the_command_that_writes_the_report(tmp_path: Path, command: str) -> None:
    (tmp_path / f"{command}.json").write_text("{}")
    with pytest.raises(InputError, match=f"sysid {command} alone writes it.*; run .* again"):
        rewrite_report(tmp_path)


def test_a_damaged_loop_is_one_line(tmp_path: Path) -> None:
    write_loop_folder(tmp_path, loop_flight())
    (tmp_path / "summary.json").write_text('{"tracking_error": {}, "onset": 30.0, "aircraft": "cdrw"}')
    with pytest.raises(InputError, match="damaged"):
        rewrite_report(tmp_path)
