"""Sound inputs to damage, made once from the bundled files."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.align import flight_record
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.csv import write_csv
from sysid_node.flight.streams import Streams

ROOT = Path(__file__).resolve().parents[2]
FORMATS = ("jsbsim", "gazebo", "rosflight")
_COMMANDS = """
import json, sys
from sysid_node.cli.main import main
sys.exit(any([main(command) for command in json.loads(sys.argv[1])]))
"""
CATALOGUE = """path,aircraft,tail,configuration,date,maintenance
mcap,cdrw,7,camera pod,2026-05-03,
sqlite3,cdrw,8,,2026-05-04,
missing.ulg,cdrw,8,,,
,,7,,2026-05-10,aileron servo replaced
"""
CATALOGUE_YAML = """flights:
  - {path: mcap, aircraft: cdrw, tail: 7, date: 2026-05-03}
  - {path: sqlite3, aircraft: cdrw, tail: 8}
maintenance:
  - {tail: 7, date: 2026-05-10, text: aileron servo replaced}
"""


@dataclass(frozen=True)
class Seeds:
    """Sound inputs: bags, a CSV, an aircraft file, a run's folder and models lie in ``folder``; ``logs`` elsewhere."""

    folder: Path
    logs: Sequence[Path]

    @classmethod
    def made(cls, folder: Path, logs: Path | None) -> Seeds:
        """Six seconds of a bundled flight in every form; the aircraft file, its exports, catalogues; logs, if any."""
        aircraft = load_aircraft("cdrw")
        streams = beginning(read_streams(ROOT / "bags" / "cdrw_multistep"), 6.0)
        for storage in ("mcap", "sqlite3"):
            write_streams(folder / storage, streams, storage)
        record = flight_record(aircraft, streams, 0.2)
        write_csv(folder / "log.csv", record)
        shutil.copy(ROOT / "config" / "aircraft" / "cdrw.yaml", folder / "aircraft.yaml")
        (folder / "fleet.csv").write_text(CATALOGUE, encoding="utf-8")
        (folder / "fleet.yaml").write_text(CATALOGUE_YAML, encoding="utf-8")
        _run(
            ["replay", str(folder / "mcap"), "--aircraft", "cdrw", "--out", str(folder / "run")],
            *(["export", "cdrw", "--format", form, "--out", str(folder / form)] for form in FORMATS),
        )
        found = sorted(logs.iterdir()) if logs else []
        return cls(folder, [log for log in found if log.is_file() and log.suffix.lower() != ".md"])


def _run(*commands: Sequence[str]) -> None:
    """Commands, in a process of their own: JAX would start threads here, without which a forked case waits for ever."""
    words = json.dumps([[*command, "--quiet"] for command in commands])
    done = subprocess.run([sys.executable, "-c", _COMMANDS, words], cwd=ROOT, check=False)
    if done.returncode:
        raise RuntimeError("a command with sound input does not end well")


def beginning(streams: Streams, seconds: float) -> Streams:
    """The messages of the first seconds of a flight."""
    end = int(streams.imu.arrival.log_ns[0]) + int(seconds * 1e9)
    parts = {}
    for name in ("imu", "air_data", "actuators"):
        stream = getattr(streams, name)
        kept = stream.arrival.log_ns < end
        arrays = {
            key: value[kept]
            for key, value in vars(stream).items()
            if isinstance(value, np.ndarray) and len(value) == kept.size
        }
        arrival = replace(stream.arrival, **{key: value[kept] for key, value in vars(stream.arrival).items()})
        parts[name] = replace(stream, arrival=arrival, **arrays)
    return replace(streams, **parts)
