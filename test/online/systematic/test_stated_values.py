"""A flight with late stamps and wrong instruments, identified with a file that states them and with one that does not.

Truth: the simulator's derivatives. What the file states is drawn about the truth within its tolerances.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.batch.identify import identify
from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.batch.settings import BatchSettings
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.align import flight_record
from sysid_node.flight.streams import Streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import DerivativeEstimate
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie

Rows = Sequence[tuple[DerivativeEstimate | ParameterEstimate, float]]
CDRW = load_aircraft("cdrw")
#: As flown, with the tolerance of each in the file.
EFFECTS = {
    "imu_delay": ({"delay": 0.02}, 0.001),
    "air_data_delay": ({"delay": 0.04}, 0.002),
    "airspeed_scale": ({"error": 0.08}, 0.005),
    "vane_scale": ({"alpha": 0.15, "beta": -0.1}, 0.01),
    "imu_misalignment": ({"roll": 0.04, "pitch": -0.05, "yaw": 0.03}, 0.003),
    "imu_lever_arm": ({"x": 0.05, "z": -0.04}, 0.003),
    "cg_shift": ({"x": 0.02, "z": 0.01}, 0.002),
    "mass_error": ({"error": 0.1}, 0.01),
}


@cache
def flight() -> tuple[Streams, dict[str, float]]:
    """The messages, and the derivatives as flown."""
    simulator = Simulator(CDRW, rate=500.0)
    plan = parse_manoeuvre("3211:repeat=2", CDRW, 500.0)
    moves = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    effects = {name: values for name, (values, _) in EFFECTS.items()}
    sortie = fly_sortie(simulator, moves, SortieConditions(effects, seed=3, command_rate=100.0))
    return FlightSampler(actuator_rate=200.0, surfaces="measured").record(sortie), dict(sortie.derivatives)


def stating(seed: int) -> Aircraft:
    rng = np.random.default_rng(seed)
    effects = {
        name: {key: UncertainValue(x + sigma * rng.standard_normal(), sigma) for key, x in values.items()}
        for name, (values, sigma) in EFFECTS.items()
    }
    return replace(CDRW, effects=effects)


def found(aircraft: Aircraft) -> list[tuple[DerivativeEstimate, float]]:
    """Valid estimates at the end, each with the truth."""
    streams, truth = flight()
    settings = OnlineSettings(actuators="positions")
    aligned = align_streams(aircraft, streams, settings.max_gap, "positions")
    final = run(aircraft, settings, aligned.time, aligned.samples, aligned.time[-1:])[-1]
    return [(d, truth[name]) for name, d in final.derivatives.items() if d.valid]


def regressed(aircraft: Aircraft) -> list[tuple[ParameterEstimate, float]]:
    """The same by equation error, which has the samples aligned already."""
    streams, truth = flight()
    record = flight_record(aircraft, streams, 0.2, "positions")
    estimates = identify("equation_error", aircraft, [record], BatchSettings(actuators="positions")).fit.estimates
    return [(e, truth[name]) for name, e in estimates.items() if e.valid]


def held(rows: Rows) -> float:
    return float(np.mean([d.lower <= truth <= d.upper for d, truth in rows]))


@pytest.mark.slow
@pytest.mark.parametrize("estimated", [found, regressed])
def test_intervals_hold_with_a_file_that_states_what_is_off_and_not_with_a_silent_one(
    estimated: Callable[[Aircraft], Rows],
) -> None:
    silent, stated = estimated(CDRW), estimated(stating(1))
    assert held(silent) < 0.8
    assert held(stated) > 0.94
    assert max(abs(d.value - truth) / d.standard_error for d, truth in stated) < 3.0
    assert len(stated) >= len(silent)
