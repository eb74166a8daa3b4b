"""The closed loop of `sysid loop`, whole but short: four nodes in processes of their own, the table, the report."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sysid_node.cli.main import main

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

ROOT = Path(__file__).resolve().parents[3]


def loop(*arguments: str) -> subprocess.CompletedProcess[str]:
    """`sysid loop` in a domain of its own."""
    environment = {**os.environ, "FASTRTPS_DEFAULT_PROFILES_FILE": str(ROOT / "config" / "local_udp.xml")}
    environment.pop("ROS_DOMAIN_ID", None)
    command = [sys.executable, "-m", "sysid_node.cli", "loop", *arguments]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_it_flies_and_writes_the_report(tmp_path: Path) -> None:
    done = loop("--seconds", "6", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert "tracking error" in done.stdout
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["adapted"] is True
    assert summary["tracking_error"]["whole flight"]["pitch"] < 0.1
    assert any(event["what"] == "excitation asked for" for event in summary["events"])
    learning = {"node": "fault_monitor", "what": "learns what sound flight is like"}
    assert any(event | learning == event for event in summary["events"])
    assert all(count > 0 for count in summary["message_troubles"].values())
    assert "Actuators carry commands" in (tmp_path / "identifier.log").read_text(encoding="utf-8")
    assert "<h3>Events</h3>" in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--fail", "wings_off:left=1"], "wings_off"),
        (["--seconds", "1"], "--seconds 1"),
        (["--aircraft", "nonesuch"], "nonesuch"),
    ],
)
def test_bad_input_is_one_line_and_code_2(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(ROOT)
    assert main(["loop", *arguments, "--out", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert words in line
