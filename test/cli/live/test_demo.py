"""The demo, whole: player and identifier in processes of their own, the table, the report."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from short_bags import short_bag

from sysid_node.cli.main import main

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

ROOT = Path(__file__).resolve().parents[3]


def demo(*arguments: str) -> subprocess.CompletedProcess[str]:
    """`sysid demo` in a domain of its own."""
    environment = {**os.environ, "FASTRTPS_DEFAULT_PROFILES_FILE": str(ROOT / "config" / "local_udp.xml")}
    environment.pop("ROS_DOMAIN_ID", None)
    command = [sys.executable, "-m", "sysid_node.cli", "demo", *arguments]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_it_identifies_a_bundled_flight_and_writes_the_report(tmp_path: Path) -> None:
    bag, out = short_bag("cdrw_multistep", 36.0, tmp_path), tmp_path / "out"
    done = demo(str(bag), "--rate", "3", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert "report:" in done.stdout
    assert "lost on the way" not in done.stdout
    assert (out / "report.html").stat().st_size > 100_000
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["aircraft"] == "cdrw"
    assert summary["rejected"] == {} or sum(summary["rejected"].values()) < 10
    valid = [name for name, found in summary["derivatives"].items() if found["valid"]]
    assert len(valid) >= 20, summary["derivatives"]
    # a busy machine may still be reading when the player has finished
    said = rf"{len(valid)} of 27 derivatives valid after (2[6-9]|3\d) s of flight, from commands\n"
    assert re.search(said, done.stdout)
    assert re.search(r"with measured positions 2\d would be valid, with intervals \d\.\d\d times as wide", done.stdout)
    for name in ("elevator", "aileron", "rudder"):
        servo = summary["servos"][name]
        assert servo["valid"] and servo["lower"] < 0.04 < servo["upper"], servo  # s, the bag's truth


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere"], "nowhere"),
        (["bags/cdrw_multistep", "--aircraft", "nonesuch"], "aircraft 'nonesuch' is not known"),
        (["bags/cdrw_multistep", "--rate", "0"], "--rate 0: expected a number over zero"),
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
    assert main(["demo", *arguments, "--out", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert words in line
