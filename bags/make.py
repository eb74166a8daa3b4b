"""Make the bundled flights: run each command of this list, then compress its bag.

    python bags/make.py [NAME...]      # all, or those named; existing ones are replaced

The list is also what ``README.md`` here shows and what the tests fly again.
"""

from __future__ import annotations

import shlex
import shutil
import sys
from pathlib import Path

from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer

from sysid_node.cli.main import main as sysid

HERE = Path(__file__).resolve().parent

_STEPS = (
    "--manoeuvre 3211:elevator:amplitude=0.06:width=0.3:start=1:every=8:repeat=7 "
    "--manoeuvre 3211:aileron:amplitude=0.06:width=0.25:start=4:every=8:repeat=7 "
    "--manoeuvre 3211:rudder:amplitude=0.12:width=0.3:start=6:every=8:repeat=7"
)

#: Servos that take their time, and whose positions are recorded as often as the motion that they make.
_SERVOS = "--effect actuator_lag:time_constant=0.04 --surfaces measured"
_FULL = f"--actuator-rate 200 {_SERVOS}"
_SMALL = f"--rate 100 --air-data-rate 50 --actuator-rate 100 {_SERVOS}"

#: name -> (what it is, the command's arguments but for --out)
FLIGHTS = {
    "cdrw_multistep": (
        "3-2-1-1 on elevator, aileron and rudder in turn, seven times; still air. The demo's flight.",
        f"--aircraft cdrw --seed 1 {_FULL} --duration 60 {_STEPS}",
    ),
    "cdrw_turbulence": (
        "The same manoeuvres in light turbulence.",
        f"--aircraft cdrw --seed 2 {_SMALL} --duration 60 --turbulence light {_STEPS}",
    ),
    "cdrw_random": (
        "Band-limited noise, 0.1 to 2 Hz, on all three surfaces at once; light turbulence.",
        f"--aircraft cdrw --seed 3 {_SMALL} --duration 60 --turbulence light "
        "--manoeuvre random:elevator,aileron,rudder:amplitude=0.06,0.06,0.12:start=1:length=56:low=0.1:high=2",
    ),
    "cdrw_slow": (
        "Slow ramps only, still air: estimates converge late, and some not at all.",
        f"--aircraft cdrw --seed 4 {_SMALL} --duration 60 "
        "--manoeuvre ramp:elevator:amplitude=0.04:start=1:length=20:every=28:repeat=2 "
        "--manoeuvre ramp:aileron:amplitude=0.02:start=8:length=20:every=28:repeat=2 "
        "--manoeuvre ramp:rudder:amplitude=0.06:start=15:length=20:every=24:repeat=2",
    ),
    "cdrw_near_stall": (
        "Slow flight, elevator steps into flow separation (Kirchhoff stall with hysteresis); still air.",
        f"--aircraft cdrw --seed 5 {_SMALL} --duration 60 --airspeed 13 "
        "--effect stall_separation:depth=1:alpha_star=0.26 "
        "--manoeuvre 3211:elevator:amplitude=0.1:width=0.4:start=2:every=10:repeat=5 "
        "--manoeuvre doublet:aileron:amplitude=0.06:width=0.4:start=6:every=10:repeat=5 "
        "--manoeuvre doublet:rudder:amplitude=0.1:width=0.4:start=8:every=10:repeat=5",
    ),
    "cdrw_failed_elevator": (
        "The elevator loses half its effect at 30 s; manoeuvres as in cdrw_multistep, light turbulence.",
        f"--aircraft cdrw --seed 6 {_SMALL} --duration 60 --turbulence light "
        f"--effect control_effectiveness_loss:elevator=0.5:onset=30 {_STEPS}",
    ),
    "cdfp_multistep": (
        "3-2-1-1 on all surfaces in turn, seven times; still air.",
        f"--aircraft cdfp --seed 7 {_SMALL} --duration 60 {_STEPS}",
    ),
    "cdfp_random": (
        "Band-limited noise, 0.1 to 2 Hz, on all three surfaces at once; light turbulence.",
        f"--aircraft cdfp --seed 8 {_SMALL} --duration 60 --turbulence light "
        "--manoeuvre random:elevator,aileron,rudder:amplitude=0.06,0.06,0.12:start=1:length=56:low=0.1:high=2",
    ),
}

_README = """# Bundled flights

These are simulated flights of the cropped-delta UAVs as rosbag2 folders (mcap, zstd-compressed chunks). They have the
sensor noise of the aircraft file, and an autopilot holds the attitude. `NAME.truth.json` beside each bag holds the true
derivatives, the effects, the trim and the seed.

`python bags/make.py [NAME...]` makes the flights again with the commands below, and compresses the bags.
"""


def arguments(name: str, folder: Path) -> list[str]:
    """The command that makes a flight in a folder, for ``sysid``."""
    return ["simulate", *shlex.split(FLIGHTS[name][1]), "--out", str(folder / name)]


def make(name: str, folder: Path) -> None:
    """One flight, compressed. Raises SystemExit where the command fails."""
    bag, raw = folder / name, folder / f"{name}.raw"
    for old in (bag, raw):
        shutil.rmtree(old, ignore_errors=True)
    code = sysid(arguments(name, folder))
    if code:
        sys.exit(code)
    bag.rename(raw)
    _compress(raw, bag)
    shutil.rmtree(raw)


def _compress(raw: Path, bag: Path) -> None:
    """The same messages in compressed chunks."""
    writer = Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with Reader(raw) as reader, writer:
        into = {}
        for c in reader.connections:
            into[c.id] = writer.add_connection(
                c.topic, c.msgtype, msgdef=c.msgdef.data, rihs01=c.digest, serialization_format="cdr"
            )
        for connection, log_ns, data in reader.messages():
            writer.write(into[connection.id], log_ns, data)


def readme() -> str:
    """README.md: what each flight is, and its command."""
    parts = [_README]
    for name, (meaning, options) in FLIGHTS.items():
        command = options.replace(" --", " \\\n    --")
        why = "<!-- not run: `bags/make.py` runs it -->"
        code = f"```bash\nsysid simulate {command} \\\n    --out bags/{name}\n```"
        parts.append(f"## {name}\n\n{meaning}\n\n{why}\n{code}\n")
    return "\n".join(parts)


if __name__ == "__main__":
    for flight in sys.argv[1:] or FLIGHTS:
        make(flight, HERE)
    (HERE / "README.md").write_text(readme(), encoding="utf-8")
