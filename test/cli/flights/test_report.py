"""``sysid report`` draws the page again, and says so where it cannot."""

import pytest

from sysid_node.cli.main import main
from sysid_node.online.types import DerivativeEstimate, Estimates
from sysid_node.report.files.runs.run_folder import write_run
from sysid_node.report.results.run_result import Prior, References, RunResult


@pytest.fixture
def folder(tmp_path):
    d = DerivativeEstimate("Cm_q", -1.3, 0.1, -1.5, -1.1, True, "ok")
    run = RunResult(
        "kestrel", "sls_rft", [Estimates(9.0, {"Cm_q": d}, {})], references=References({"Cm_q": Prior(-1.2, 0.3)})
    )
    write_run(tmp_path, run)
    return tmp_path


def test_the_page_comes_back_as_it_was(folder, capsys):
    page = folder / "report.html"
    before = page.read_bytes()
    page.unlink()
    assert main(["report", str(folder)]) == 0
    assert page.read_bytes() == before
    assert capsys.readouterr().out.strip() == str(page)


def test_quiet_is_silent(folder, capsys):
    assert main(["report", str(folder), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_folder_without_a_run_is_bad_input(tmp_path, capsys):
    assert main(["report", str(tmp_path / "nowhere")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("sysid report: ")
    assert "no summary.json in it" in said
    assert said.count("\n") == 1
