"""Makes the pictures of reports in the tutorial and the README: ``python docs/make_pictures.py``.

Runs the tutorial's own commands in ``out/pictures`` (what is there already is not run again), and photographs sections
of the reports by Chromium, without a network. About three minutes, and nothing that a build of the site needs.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
WORK = ROOT / "out" / "pictures"
PICTURES = ROOT / "docs" / "pictures"

SLOW = "--effect actuator_lag:time_constant=0.1"
#: What is run, by the folder that it fills: the commands of docs/start.
RUNS = {
    "replay": "replay bags/cdrw_multistep --aircraft cdrw",
    "failed": "replay bags/cdrw_failed_elevator --aircraft cdrw",
    "first": f"simulate --aircraft cdrw --manoeuvre 3211:repeat=2 {SLOW} --seed 1",
    "second": f"simulate --aircraft cdrw --manoeuvre multisine {SLOW} --seed 2",
    "gap": "gap out/pictures/first --holdout out/pictures/second --aircraft cdrw",
}
#: Name of each picture: the run whose report it shows, the sections, and its size in pixels.
SHOWN = {
    "replay_opening": ("replay", ("opening", "derivatives"), (1200, 1080)),
    "replay_history": ("replay", ("history",), (900, 668)),
    "failed_faults": ("failed", ("faults",), (1000, 310)),
    "gap_opening": ("gap", ("opening",), (900, 330)),
    "gap_channels": ("gap", ("channels",), (900, 640)),
    "gap_where": ("gap", ("where",), (900, 525)),
    "gap_flight": ("gap", ("flight",), (900, 480)),
    "gap_candidates": ("gap", ("candidates",), (900, 580)),
}
#: Name of each picture of the viewer: the run that it shows. Needs requirements/view.txt and Xvfb.
VIEWED = {"view_run": "failed", "view_gap": "gap"}
#: The bag that is flown live, over DDS, before the live view; what the view shows is written and then drawn.
LIVE = "bags/cdrw_multistep"
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--virtual-time-budget=20000", "--host-resolver-rules=MAP * ~NOTFOUND"),
)


def main() -> None:
    """Runs what is missing, and writes every picture."""
    WORK.mkdir(parents=True, exist_ok=True)
    PICTURES.mkdir(exist_ok=True)
    for name, arguments in RUNS.items():
        if not (WORK / name).exists():
            command = [sys.executable, "-m", "sysid_node.cli", *arguments.split(), "--out", f"out/pictures/{name}"]
            subprocess.run(command, cwd=ROOT, check=True)
    for name, (run, sections, size) in SHOWN.items():
        photograph(WORK / run / "report.html", sections, size, PICTURES / f"{name}.png")
    for name, run in VIEWED.items():
        view(WORK / run, PICTURES / f"{name}.png")
    recording = WORK / "live.rrd"
    command = [sys.executable, "-m", "sysid_node.cli", "demo", LIVE, "--view", recording, "--out", WORK / "live"]
    subprocess.run(command, cwd=ROOT, check=True)
    draw(recording, PICTURES / "view_live.png")


def view(run: Path, out: Path) -> None:
    """A picture of a run in the viewer, as it opens."""
    recording = WORK / f"{run.name}.rrd"
    subprocess.run([sys.executable, "-m", "sysid_node.cli", "view", run, "--save", recording], cwd=ROOT, check=True)
    draw(recording, out)


def draw(recording: Path, out: Path) -> None:
    """A picture of a recording in the viewer, drawn without a screen."""
    viewer = ["rerun", str(recording), "--screenshot-to", str(out), "--window-size", "1440x810"]
    subprocess.run(["xvfb-run", "-a", "-s", "-screen 0 1440x810x24", *viewer], check=True)
    with Image.open(out) as picture:  # the viewer draws two pixels for one
        small = picture.convert("RGB").resize((1440, 810)).quantize(256)
    small.save(out, optimize=True)


def photograph(report: Path, sections: tuple[str, ...], size: tuple[int, int], out: Path) -> None:
    """A picture of some sections of a report, from their top, as wide and high as ``size`` in pixels."""
    kept = "".join(f":not(#{section})" for section in sections)
    style = f"<style>section{kept}, nav {{display: none !important}} h1 {{font-size: 1.4rem}}</style></head>"
    page = re.sub("</head>", lambda _: style, report.read_text(encoding="utf-8"), count=1)
    if "opening" not in sections:
        page = page.replace("<h1", '<h1 style="display: none"', 1).replace(
            "<body", '<body style="margin-top: -85px"', 1
        )
    copy = report.with_name("picture.html")
    copy.write_text(page, encoding="utf-8")
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        raise SystemExit("make_pictures.py: no Chromium or Chrome found: install one")
    profile = f"--user-data-dir={WORK / 'profile'}"
    window = f"--window-size={size[0]},{size[1]}"
    subprocess.run([chromium, *FLAGS, profile, window, f"--screenshot={out}", copy.as_uri()], check=True)


if __name__ == "__main__":
    main()
