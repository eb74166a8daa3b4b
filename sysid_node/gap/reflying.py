"""A diagnosis flown in the user's simulator: with its model as it was, and with the correction written into it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sysid_node.gap.correction import corrected_aircraft
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import gap_content
from sysid_node.gap.validation.handed_on import corrected_parameters
from sysid_node.gap.validation.reflown import Reflown, reflown
from sysid_node.sim.correcting.user_simulator import UserSimulator


@dataclass(frozen=True)
class InSimulator:
    """What a correction does in the user's simulator."""

    simulator: UserSimulator
    result: Reflown | None  # none where short flights cannot be flown there
    left_out: Mapping[str, str]  # effects that the model cannot hold, and why

    def write_model(self, found: Diagnosis, folder: Path) -> None:
        """Write the corrected model into a folder. Raises InputError."""
        self.simulator.corrected(corrected_aircraft(found), folder)


def fly_in(simulator: UserSimulator, found: Diagnosis) -> InSimulator:
    """Flies the commands of the flights on which the gap is measured, with both models. Raises InputError."""
    with tempfile.TemporaryDirectory(prefix="sysid-") as place:
        model = simulator.corrected(corrected_aircraft(found), Path(place))
        before, after = simulator.flyers(model, found.models[0].simulator.rate)
    thetas = [corrected_parameters(found.attribution.corrected, each) for each in found.models]
    return InSimulator(simulator, reflown(found.models, thetas, before, after), model.left_out)


def reflown_content(flown: InSimulator) -> dict[str, Any]:
    """``reflown`` of gap.json; errors are null where short flights could not be flown in the user's simulator."""
    content: dict[str, Any] = {"simulator": flown.simulator.label, "left_out": dict(flown.left_out)}
    names = ("before", "after", "noise_floor", "shrink_percent", "ci95", "intervals", "per_channel")
    if flown.result is None:
        return {**dict.fromkeys(names), **content}
    gap = gap_content(flown.result.gap)
    channels = {
        channel: {stage: errors[stage] for stage in names[:3]} for channel, errors in gap["per_channel"].items()
    }
    ends = {name: ends for name, ends in gap["intervals"].items() if name in names}
    return {**{name: gap[name] for name in names}, "intervals": ends, "per_channel": channels, **content}
