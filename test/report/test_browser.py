"""The page in a real browser: every plot is drawn and nothing is complained of."""

import re
import shutil
import subprocess

import pytest
import synthetic

from sysid_node.report.page import write_report

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--enable-logging=stderr", "--virtual-time-budget=20000", "--host-resolver-rules=MAP * ~NOTFOUND"),
)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium or Chrome found")
def test_plots_are_drawn_without_a_complaint(tmp_path):
    path = tmp_path / "report.html"
    write_report(path, synthetic.run(seconds=20.0))
    command = [CHROMIUM, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", path.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert re.findall(r".*CONSOLE.*", done.stderr) == []
    plots = done.stdout.count('aria-label="') - done.stdout.count('<nav aria-label="')
    assert plots > len(synthetic.TRUTH)
    assert done.stdout.count('class="user-select-none svg-container"') == done.stdout.count('role="img"') == plots
