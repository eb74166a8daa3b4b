"""Flights in which readings are made wrong: real, bundled and simulated ones."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

from bench.speed.diagnosis import flown

_BAGS = Path(__file__).parents[2] / "bags"
_AIRCRAFT = ("cdrw", "cdfp", "kestrel")
_WEATHERS = ("none", "light", "moderate")

Flight = TypeVar("Flight")


def grouped(real: Iterable[Flight], read: Callable[[Path, str], Flight], first: int) -> dict[str, list[Flight]]:
    """The flights by group; ``read`` takes a bag and the name of its aircraft."""
    bundled = sorted(path for path in _BAGS.glob("cd*_*") if path.is_dir())
    groups = {"real": list(real), "bundled": [read(bag, bag.name[:4]) for bag in bundled]}
    with tempfile.TemporaryDirectory() as folder:
        for weather in _WEATHERS:
            flights = [
                read(_simulated(Path(folder), name, weather, manoeuvre, seed), name)
                for name in _AIRCRAFT
                for seed, manoeuvre in enumerate(("3211", "multisine"), first)
            ]
            groups[f"simulated, turbulence {weather}"] = flights
    return groups


def _simulated(folder: Path, name: str, weather: str, manoeuvre: str, seed: int) -> Path:
    words = ("--manoeuvre", manoeuvre, "--duration", "60", "--turbulence", weather)
    return flown(folder / f"{name}_{weather}_{manoeuvre}", seed, words, name)
