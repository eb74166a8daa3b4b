"""Flights in which nothing fails, as users have them, and one fault in such a flight. The truth is what was flown."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid_node import load
from sysid_node import replay as replayed
from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main
from sysid_node.faults.recorded_flight import FaultVerdict
from sysid_node.faults.types import LOSS
from sysid_node.flight.csv import write_csv

MANOEUVRE = ("--manoeuvre", "3211:repeat=3")


def simulated(folder: Path, aircraft: str, *flown: str) -> Path:
    """A flight in still air."""
    bag = folder / "flight"
    words = ["simulate", "--aircraft", aircraft, "--turbulence", "none", "--quiet", "--out", str(bag), *flown]
    assert main(words) == 0
    return bag


def as_table(bag: Path, aircraft: str) -> Path:
    """The same flight as a table of the IMU's rate, all else interpolated to it."""
    write_csv(bag.with_suffix(".csv"), load(bag, aircraft).record)
    return bag.with_suffix(".csv")


def verdict_on(flight: Path, aircraft: str) -> FaultVerdict:
    """What the replay says of faults."""
    found = replayed(load(flight, aircraft)).faults
    assert found is not None
    assert found.judged > 10.0
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("aircraft", "table"), [("cdrw", True), ("cdfp", False), ("kestrel", False)])
def test_sensors_without_noise_are_no_fault(tmp_path: Path, aircraft: str, table: bool) -> None:
    """Residuals are model errors alone, which prove a fault when they are compared with themselves."""
    flight = simulated(tmp_path, aircraft, *MANOEUVRE, "--noise", "0", "--seed", "3")
    found = verdict_on(as_table(flight, aircraft) if table else flight, aircraft)
    assert not found.episodes, found.sentences


@pytest.mark.slow
def test_estimates_that_are_adopted_in_still_air_are_no_fault(tmp_path: Path) -> None:
    """What was learned before was about another offset, which counted as a change by hundreds of standard errors."""
    flight = simulated(tmp_path, "cdrw", *MANOEUVRE, "--seed", "41")
    found = verdict_on(as_table(flight, "cdrw"), "cdrw")
    assert not found.episodes, found.sentences


@pytest.mark.slow
def test_the_size_of_a_fault_in_still_air_is_from_the_whole_of_it(tmp_path: Path) -> None:
    """An onset that is one block late puts the first block with the fault into the model without it."""
    lost = "control_effectiveness_loss:elevator=0.4:onset=34"
    flight = simulated(tmp_path, "cdrw", *MANOEUVRE, "--seed", "42", "--effect", lost)
    (episode,) = verdict_on(as_table(flight, "cdrw"), "cdrw").episodes
    assert (episode.fault.kind, episode.fault.part) == (LOSS, "elevator")
    assert episode.fault.lower <= 0.4 <= episode.fault.upper


@pytest.mark.slow
def test_a_file_that_is_wrong_is_no_fault(tmp_path: Path) -> None:
    """All derivatives are off by 2.5 tolerances, and the first manoeuvre comes after the monitor has learned.

    Without noise this is where least is needed for a contradiction. Some surfaces have never moved before.
    """
    late = "3211:elevator:start=24 + 3211:aileron:start=31 + 3211:rudder:start=38"
    flown = ("--manoeuvre", late, "--noise", "0", "--seed", "2", "--duration", "50")
    flight, random = simulated(tmp_path, "cdrw", *flown), np.random.default_rng(1)
    aircraft = load_aircraft("cdrw")
    guessed = {
        name: replace(d, value=d.value + 2.5 * (d.tolerance or 0.0) * random.choice([-1, 1]))
        for name, d in aircraft.derivatives.items()
        if not name.endswith("_0")
    }
    file = tmp_path / "guess.yaml"
    file.write_text(dump_aircraft(replace(aircraft, derivatives={**aircraft.derivatives, **guessed})), encoding="utf-8")
    found = verdict_on(flight, str(file))
    assert not found.episodes, found.sentences
