"""Commands alone, servos of which the aircraft file says nothing: the truth is what was flown."""

from pathlib import Path

import pytest

from sysid_node import load, replay
from sysid_node.cli.main import main
from sysid_node.faults.recorded_flight import FaultVerdict
from sysid_node.faults.types import LOSS

LATE = "actuator_lag:time_constant=0.1"  # s


def verdict_on(bag: Path, *flown: str) -> FaultVerdict:
    """What the replay of a simulated flight says of faults, as ``sysid replay`` does."""
    words = ["simulate", "--aircraft", "cdrw", "--seed", "1", "--effect", LATE, "--quiet", "--out", str(bag), *flown]
    assert main(words) == 0
    found = replay(load(bag, "cdrw")).faults
    assert found is not None
    return found


@pytest.mark.slow
def test_half_of_an_elevator_is_found_beside_them_and_no_damage_before(tmp_path: Path) -> None:
    """The identifier knows the servos' times only at the end of what the monitor has learned from."""
    lost = "control_effectiveness_loss:elevator=0.5:onset=34"
    verdict = verdict_on(tmp_path / "flight", "--manoeuvre", "3211:repeat=3", "--effect", lost)
    assert verdict.judged > 10.0
    (episode,) = verdict.episodes
    fault = episode.fault
    assert (fault.kind, fault.part) == (LOSS, "elevator")
    assert fault.lower <= 0.5 <= fault.upper
    assert fault.found == pytest.approx(39.0, abs=6.0)
