"""Sound inputs to begin with, and the commands that each kind of damaged input is given to."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.robustness.mutations import ODD_NUMBERS, damage_bytes, damage_text
from sysid_node.aircraft.load import load_aircraft
from sysid_node.batch.identify import METHODS
from sysid_node.cli.main import main
from sysid_node.flight.align import flight_record
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.csv import write_csv
from sysid_node.flight.streams import Streams

ROOT = Path(__file__).resolve().parents[2]
LOG_LIMIT = 3_000_000  # bytes of a log that are kept, so that a case is quick

#: A case: writes the damaged input into a folder and gives the command's words.
Case = Callable[[Path, random.Random], list[str]]


@dataclass(frozen=True)
class Seeds:
    """Sound inputs, made once."""

    folder: Path
    logs: Sequence[Path]

    @classmethod
    def made(cls, folder: Path, logs: Path | None) -> Seeds:
        """Six seconds of a bundled flight as bags, CSV and a replay's folder; the aircraft file; logs, if any."""
        aircraft = load_aircraft("cdrw")
        streams = _first(read_streams(ROOT / "bags" / "cdrw_multistep"), 6.0)
        for storage in ("mcap", "sqlite3"):
            write_streams(folder / storage, streams, storage)
        record = flight_record(aircraft, streams, 0.2)
        write_csv(folder / "log.csv", record)
        shutil.copy(ROOT / "config" / "aircraft" / "cdrw.yaml", folder / "aircraft.yaml")
        arguments = ["replay", str(folder / "mcap"), "--aircraft", "cdrw", "--out", str(folder / "run"), "--quiet"]
        if main(arguments):
            raise RuntimeError("a sound bag cannot be replayed")
        found = sorted(logs.iterdir()) if logs else []
        return cls(folder, [log for log in found if log.is_file() and log.suffix.lower() != ".md"])

    def cases(self) -> dict[str, Case]:
        """The kinds of cases, by name."""
        kinds: dict[str, Case] = {
            "bag, mcap": lambda place, rng: self._bag(place, rng, "mcap"),
            "bag, sqlite3": lambda place, rng: self._bag(place, rng, "sqlite3"),
            "CSV": self._csv,
            "aircraft file": self._aircraft,
            "folder of a run": self._run_folder,
            "summary to export": self._summary,
            "options": self._options,
        }
        return {**kinds, "log": self._log} if self.logs else kinds

    def _bag(self, place: Path, rng: random.Random, storage: str) -> list[str]:
        bag = place / "bag"
        shutil.copytree(self.folder / storage, bag)
        file = rng.choice([*bag.glob(f"{storage}.*"), *bag.glob(f"{storage}.*"), bag / "metadata.yaml"])
        if file.name == "metadata.yaml":
            file.write_bytes(damage_text(file.read_text(), rng))
        else:
            file.write_bytes(damage_bytes(file.read_bytes(), rng))
        given = file if rng.random() < 0.2 and file.suffix != ".yaml" else bag
        return rng.choice(
            [
                ["replay", str(given), "--aircraft", "cdrw", "--out", str(place / "out")],
                [
                    "identify",
                    str(given),
                    "--aircraft",
                    "cdrw",
                    "--method",
                    "equation_error",
                    "--out",
                    str(place / "out"),
                ],
                ["convert", str(given), "--out", str(place / "converted")],
            ]
        )

    def _sound(self, place: Path) -> str:
        """A sound bag, beside what is damaged."""
        shutil.copytree(self.folder / "mcap", place / "sound")
        return str(place / "sound")

    def _csv(self, place: Path, rng: random.Random) -> list[str]:
        (place / "log.csv").write_bytes(damage_text((self.folder / "log.csv").read_text(), rng))
        identify = ["identify", str(place / "log.csv"), "--aircraft", "cdrw", "--out", str(place / "out"), "--method"]
        return rng.choice(
            [
                ["convert", str(place / "log.csv"), "--out", str(place / "converted")],
                [*identify, rng.choice(("equation_error", "frequency_equation_error", "recursive_least_squares"))],
            ]
        )

    def _aircraft(self, place: Path, rng: random.Random) -> list[str]:
        file = place / "aircraft.yaml"
        file.write_bytes(damage_text((self.folder / "aircraft.yaml").read_text(), rng))
        form = rng.choice(("jsbsim", "gazebo", "rosflight"))
        bag = self._sound(place)
        return rng.choice(
            [
                ["export", str(file), "--format", form, "--out", str(place / "model")],
                ["replay", bag, "--aircraft", str(file), "--out", str(place / "out")],
                ["identify", bag, "--aircraft", str(file), "--method", "equation_error", "--out", str(place / "out")],
            ]
        )

    def _run_folder(self, place: Path, rng: random.Random) -> list[str]:
        shutil.copytree(self.folder / "run", place / "run", ignore=shutil.ignore_patterns("estimates", "report.html"))
        file = rng.choice(sorted((place / "run").iterdir()))
        file.write_bytes(damage_text(file.read_text(), rng))
        return ["report", str(place / "run")]

    def _summary(self, place: Path, rng: random.Random) -> list[str]:
        (place / "summary.json").write_bytes(damage_text((self.folder / "run" / "summary.json").read_text(), rng))
        form = rng.choice(("jsbsim", "gazebo", "rosflight"))
        return ["export", str(place / "summary.json"), "--format", form, "--out", str(place / "model")]

    def _options(self, place: Path, rng: random.Random) -> list[str]:
        bag, out = (
            str(self.folder / "mcap"),
            str(place / ("x" * rng.choice((3, 3, 300)) if rng.random() < 0.1 else "o")),
        )
        common = ["--aircraft", rng.choice(("cdrw", "cdrw", "cdwr", "x" * 300, "/", ".", "")), "--out", out]
        odd = lambda: rng.choice((*ODD_NUMBERS, "0.5", "3", "10"))  # noqa: E731
        if rng.random() < 0.5:
            keys = (
                "window",
                "forgetting_time",
                "settle_time",
                "max_gap",
                "publish_rate",
                "valid_fraction",
                "use_prior",
            )
            words = ["replay", bag, *common, "--set", f"{rng.choice(keys)}={odd()}"]
        else:
            keys = ("low_pass", "rate", "segment", "states", "biases", "use_prior", "stepwise", "max_gap", "actuators")
            method = rng.choice([name for name in METHODS if "equation" in name or "recursive" in name])
            words = ["identify", bag, *common, "--method", method, "--set", f"{rng.choice(keys)}={odd()}"]
        if rng.random() < 0.4:
            words += ["--frequencies", ":".join(odd() for _ in range(rng.choice((2, 3, 3, 3, 4))))]
        if rng.random() < 0.1:
            words += ["--topic", rng.choice(("imu/data:=", "x:=y", ":=", "imu/data:=/air_data", "imu/data:=/\u00e4"))]
        return words

    def _log(self, place: Path, rng: random.Random) -> list[str]:
        log = rng.choice(self.logs)
        file = place / log.name
        with log.open("rb") as stream:
            file.write_bytes(damage_bytes(stream.read(LOG_LIMIT), rng))
        return ["convert", str(file), "--out", str(place / "converted")]


def _first(streams: Streams, seconds: float) -> Streams:
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
