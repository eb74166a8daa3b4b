"""A live flight that was lost is known as such, before its readings are not finite any more."""

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.flying import live

SIMULATOR = Simulator(load_aircraft("cdrw"), 100.0)
TRIM = trim_flight(SIMULATOR)


def flown(effects: list[str], seconds: float) -> tuple[float, str]:
    """Flies with the controls of level flight; the time and the reason of the divergence."""
    air = live.LiveConditions(noise=0.0)
    flight = live.start(SIMULATOR, TRIM, air, live.vector(SIMULATOR, effects))
    for _ in range(round(seconds * 100)):
        now = live.step(SIMULATOR, flight, TRIM.command.tolist())
        if why := live.divergence(now):
            return now.time, why
    return np.inf, ""


@pytest.mark.slow
def test_level_flight_does_not_diverge() -> None:
    assert flown([], 3.0) == (np.inf, "")


def test_an_aircraft_that_is_far_from_stable_does() -> None:
    """The mass 2 m behind the reference point: no pilot, no model."""
    time, why = flown(["cg_shift:x=-2"], 30.0)
    assert time < 30.0
    assert why


@pytest.mark.parametrize("part", ["outputs", "state", "surfaces"])
def test_what_is_not_finite_is_named(part: str) -> None:
    now = live.step(SIMULATOR, live.start(SIMULATOR, TRIM, live.LiveConditions(), SIMULATOR.neutral()), TRIM.command)
    broken = now._replace(**{part: np.full_like(getattr(now, part), np.nan)})
    assert live.divergence(broken) == f"{part} are not finite"
