"""A diagnosis flown in the user's simulator: with its model as it was, and with the correction written into it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sysid_node.gap.correction import corrected_aircraft
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.estimation.predictive_density import transferred_parameters
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
    thetas = [transferred_parameters(found.attribution.corrected, each) for each in found.models]
    return InSimulator(simulator, reflown(found.models, thetas, before, after), model.left_out)
