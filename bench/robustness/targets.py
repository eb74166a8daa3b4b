"""The commands that each kind of damaged input is given to."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from pathlib import Path

from bench.robustness.mutations import ODD_NUMBERS, damage_bytes, damage_text
from bench.robustness.seeds import FORMATS, Seeds
from sysid_node.batch.identify import METHODS

LOG_LIMIT = 3_000_000  # bytes of a log that are kept, so that a case is quick
SETTINGS = ("window", "forgetting_time", "settle_time", "max_gap", "publish_rate", "valid_fraction", "use_prior")
METHOD_SETTINGS = (
    "low_pass",
    "rate",
    "segment",
    "states",
    "biases",
    "use_prior",
    "stepwise",
    "max_gap",
    "actuators",
)
SIMULATED = ("--seed", "--duration", "--airspeed", "--height", "--noise", "--rate", "--air-data-rate")
DESIGNED = ("--rate", "--duration", "--airspeed")

#: A case: writes the damaged input into a folder and gives the command's words.
Case = Callable[[Path, random.Random], list[str]]


class Targets:
    """Cases made of sound inputs."""

    def __init__(self, seeds: Seeds) -> None:
        self.seeds = seeds

    def quick(self) -> dict[str, Case]:
        """The kinds of cases that take less than a second or so, by name."""
        kinds: dict[str, Case] = {
            "bag, mcap": lambda place, rng: self._bag(place, rng, "mcap"),
            "bag, sqlite3": lambda place, rng: self._bag(place, rng, "sqlite3"),
            "CSV": self._csv,
            "aircraft file": self._aircraft,
            "folder of a run": self._run_folder,
            "summary to export": self._summary,
            "model to import": self._model,
            "catalogue of a fleet": self._catalogue,
            "options": self._options,
        }
        return {**kinds, "log": self._log} if self.seeds.logs else kinds

    def slow(self) -> dict[str, Case]:
        """The kinds of cases that compile or fit for seconds where the input passes."""
        return {"simulate, excite": self._simulated, "gap": self._gap}

    def _bag(self, place: Path, rng: random.Random, storage: str) -> list[str]:
        given, out = self._damaged_bag(place, rng, storage), str(place / "out")
        words = [str(given), "--aircraft", "cdrw"]
        return rng.choice(
            [
                ["replay", *words, "--out", out],
                ["identify", *words, "--method", "equation_error", "--out", out],
                ["convert", str(given), "--out", str(place / "converted")],
                ["check", str(given)],
                ["view", *words, "--save", str(place / "o")],
            ]
        )

    def _damaged_bag(self, place: Path, rng: random.Random, storage: str) -> Path:
        """A bag of which one file is damaged; one time in five the file alone."""
        bag = place / "bag"
        shutil.copytree(self.seeds.folder / storage, bag)
        file = rng.choice([*bag.glob(f"{storage}.*"), *bag.glob(f"{storage}.*"), bag / "metadata.yaml"])
        if file.name == "metadata.yaml":
            file.write_bytes(damage_text(file.read_text(), rng))
        else:
            file.write_bytes(damage_bytes(file.read_bytes(), rng))
        return file if rng.random() < 0.2 and file.suffix != ".yaml" else bag

    def _sound(self, place: Path) -> str:
        """A sound bag, beside what is damaged."""
        shutil.copytree(self.seeds.folder / "mcap", place / "sound")
        return str(place / "sound")

    def _damaged_text(self, place: Path, rng: random.Random, name: str, given: str = "") -> str:
        """A damaged copy of one of the seeds' texts, under the name ``given``."""
        file = place / (given or name)
        file.write_bytes(damage_text((self.seeds.folder / name).read_text(encoding="utf-8"), rng))
        return str(file)

    def _csv(self, place: Path, rng: random.Random) -> list[str]:
        log = self._damaged_text(place, rng, "log.csv")
        methods = ("equation_error", "frequency_equation_error", "recursive_least_squares")
        identify = ["identify", log, "--aircraft", "cdrw", "--out", str(place / "out"), "--method"]
        return rng.choice(
            [
                ["convert", log, "--out", str(place / "converted")],
                ["check", log],
                [*identify, rng.choice(methods)],
            ]
        )

    def _aircraft(self, place: Path, rng: random.Random) -> list[str]:
        file, form = self._damaged_text(place, rng, "aircraft.yaml"), rng.choice(FORMATS)
        words = [self._sound(place), "--aircraft", file, "--out", str(place / "out")]
        return rng.choice(
            [
                ["export", file, "--format", form, "--out", str(place / "model")],
                ["replay", *words],
                ["identify", *words, "--method", "equation_error"],
                ["aircraft", file],
            ]
        )

    def _run_folder(self, place: Path, rng: random.Random) -> list[str]:
        run = place / "run"
        shutil.copytree(self.seeds.folder / "run", run, ignore=shutil.ignore_patterns("estimates", "report.html"))
        file = rng.choice(sorted(run.iterdir()))
        file.write_bytes(damage_text(file.read_text(), rng))
        return rng.choice([["report", str(run)], ["report", str(run)], ["view", str(run), "--save", str(place / "o")]])

    def _summary(self, place: Path, rng: random.Random) -> list[str]:
        summary = self._damaged_text(place, rng, "run/summary.json", "summary.json")
        return ["export", summary, "--aircraft", "cdrw", "--format", rng.choice(FORMATS), "--out", str(place / "model")]

    def _model(self, place: Path, rng: random.Random) -> list[str]:
        form = rng.choice(FORMATS)
        model = self._damaged_text(place, rng, form, "model.xml" if form == "jsbsim" else "model.sdf")
        return ["import", model, "--format", form, "--out", str(place / "o.yaml")]

    def _catalogue(self, place: Path, rng: random.Random) -> list[str]:
        for storage in ("mcap", "sqlite3"):
            (place / storage).symlink_to(self.seeds.folder / storage)
        catalogue = self._damaged_text(place, rng, rng.choice(("fleet.csv", "fleet.yaml")))
        return ["fleet", catalogue, "--out", str(place / "out"), "--workers", "1", "--dry-run"]

    def _options(self, place: Path, rng: random.Random) -> list[str]:
        name = "x" * rng.choice((3, 3, 300)) if rng.random() < 0.1 else "o"
        common = ["--aircraft", rng.choice(("cdrw", "cdrw", "cdwr", "x" * 300, "/", ".", "")), "--out"]
        bag, common = str(self.seeds.folder / "mcap"), [*common, str(place / name)]
        if rng.random() < 0.5:
            words = ["replay", bag, *common, "--set", f"{rng.choice(SETTINGS)}={_odd(rng)}"]
        else:
            method = rng.choice([one for one in METHODS if "equation" in one or "recursive" in one])
            setting = f"{rng.choice(METHOD_SETTINGS)}={_odd(rng)}"
            words = ["identify", bag, *common, "--method", method, "--set", setting]
        if rng.random() < 0.4:
            words += ["--frequencies", ":".join(_odd(rng) for _ in range(rng.choice((2, 3, 3, 3, 4))))]
        if rng.random() < 0.1:
            words += ["--topic", rng.choice(("imu/data:=", "x:=y", ":=", "imu/data:=/air_data", "imu/data:=/\u00e4"))]
        return words

    def _log(self, place: Path, rng: random.Random) -> list[str]:
        log = rng.choice(self.seeds.logs)
        file = place / log.name
        with log.open("rb") as stream:
            file.write_bytes(damage_bytes(stream.read(LOG_LIMIT), rng))
        return rng.choice([["convert", str(file), "--out", str(place / "converted")], ["check", str(file)]])

    def _simulated(self, place: Path, rng: random.Random) -> list[str]:
        aircraft = self._damaged_text(place, rng, "aircraft.yaml") if rng.random() < 0.5 else "cdrw"
        manoeuvre = damage_text(rng.choice(("3211", "doublet:elevator:amplitude=0.05", "multisine")), rng)
        spec = rng.choice(("doublet", manoeuvre.decode("utf-8", "replace").replace("\x00", "")))
        out, command = ["--out", str(place / "out")], rng.choice(("simulate", "excite"))
        words = [command, "--aircraft", aircraft, "--manoeuvre", spec, "--duration", "5", *out]
        if rng.random() < 0.5:
            words += [rng.choice(SIMULATED if command == "simulate" else DESIGNED), _odd(rng)]
        if rng.random() < 0.3:
            added = rng.choice(("turbulence", "actuator_lag:tau=0.1", "icing:severity=", "x:y=1", ":="))
            words += ["--effect", added] if command == "simulate" else ["--envelope", added]
        return words

    def _gap(self, place: Path, rng: random.Random) -> list[str]:
        given = self._damaged_bag(place, rng, rng.choice(("mcap", "sqlite3")))
        flight = rng.choice((str(given), self._damaged_text(place, rng, "log.csv")))
        return ["gap", flight, "--aircraft", "cdrw", "--out", str(place / "out")]


def _odd(rng: random.Random) -> str:
    return rng.choice((*ODD_NUMBERS, "0.5", "3", "10"))
