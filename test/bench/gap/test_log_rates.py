"""The bench of causes at the rates of logs. Truth: the simulator's own effects, and gap.json by hand."""

import json

import pytest

from bench.estimation.log_rates import LOGS
from bench.gap import log_rates
from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import Simulator


@pytest.mark.parametrize("effect", [name for name in log_rates.EFFECTS if name])
def test_every_effect_can_be_simulated(effect: str) -> None:
    simulator = Simulator(load_aircraft("cdrw"), 100.0)
    moved = simulator.vector({effect: log_rates.EFFECTS[effect]}) != simulator.neutral()
    assert moved.sum() == len(log_rates.EFFECTS[effect])


def test_finished_cases_are_counted(tmp_path) -> None:
    """Of eight effects one is named with its size, one with another size, the others are called the first."""
    label = next(iter(LOGS))
    for effect in log_rates.EFFECTS:
        named = effect if effect == "imu_bias" else "actuator_lag"
        sizes = {"q": [0.041, 0.001]} if effect == "imu_bias" else {"elevator": [0.2, 0.01]}
        cause = {"effect": named, "probability": 0.9, "indistinguishable_from": [], "parameters": sizes}
        said = {"verdict": "explained", "causes": [cause], "gap": {"after": 0.1}}
        (tmp_path / f"steps_{effect or 'none'}_0.json").write_text(json.dumps(said))
    row = log_rates.row_of(tmp_path, "steps", label)
    assert row[1:5] == ("2 of 8", "1 of 2", "6", "a cause is blamed")
    assert "`imu_bias`" not in row[5] and "`actuator_lag`" in row[5]
