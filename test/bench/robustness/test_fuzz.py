"""A bounded share of ``make fuzz``: no damaged input crashes, hangs, or ends in more than one line."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.slow
def test_damaged_input_of_every_kind_is_one_line(tmp_path):
    command = [
        sys.executable,
        "-m",
        "bench.robustness.fuzz",
        "--cases",
        "18",
        "--fast",
        "--seed",
        "11",
        "--out",
        str(tmp_path / "cases"),
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "| all | 18 | 0 |" in done.stdout, done.stdout
