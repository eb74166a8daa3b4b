"""Servos at their rate limits: found from commands and motion; truth: an equation of motion written here."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.faults.recorded_rate_limits import rate_limits_of
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]
AIRCRAFT = load_aircraft("cdrw")
STEP, SECONDS, LAG = 0.01, 20.0, 0.03


def followed(commands: Array, rate: float) -> Array:
    """A lag of first order, then a limit of its rate (rad/s)."""
    lagged = position = commands[0]
    found = []
    for command in commands:
        found.append(position)
        lagged += (1.0 - np.exp(-STEP / LAG)) * (command - lagged)
        position += float(np.clip(lagged - position, -rate * STEP, rate * STEP))
    return np.array(found)


def of_second_order(commands: Array, frequency: float) -> Array:
    """A servo with a damping of 0.7."""
    w = 2.0 * np.pi * frequency
    servo = signal.cont2discrete(([w * w], [1.0, 1.4 * w, w * w]), STEP)
    return np.asarray(signal.lfilter(servo[0].ravel(), servo[1], commands))


def rolled(amplitude: float, servo: Callable[[Array], Array]) -> FlightRecord:
    """Roll alone, p' = L(p, da), by commands that step in both directions, at constant speed."""
    random, time = np.random.default_rng(5), np.arange(0.0, SECONDS, STEP)
    commands = amplitude * random.choice([-1.0, 0.0, 1.0], size=time.size // 60 + 1)[(np.arange(time.size)) // 60]
    deflections = servo(commands)
    V, d = AIRCRAFT.reference.airspeed, {n: x.value for n, x in AIRCRAFT.derivatives.items()}
    pressure = 0.5 * AIRCRAFT.reference.air_density * V**2 * AIRCRAFT.geometry.S * AIRCRAFT.geometry.b
    p, rates = 0.0, []
    for da in deflections:
        rates.append(p)
        Cl = d["Cl_p"] * p * AIRCRAFT.geometry.b / (2.0 * V) + d["Cl_da"] * da
        p += STEP * pressure * Cl / AIRCRAFT.inertia.Ixx
    names = ("ax", "ay", "az", "q", "r", "alpha", "beta", "thrust", "de", "dr")
    columns = {name: 0.001 * random.normal(size=time.size) for name in names}
    columns |= {"p": np.array(rates) + 0.002 * random.normal(size=time.size), "V": np.full(time.size, V)}
    columns |= {"rho": np.full(time.size, AIRCRAFT.reference.air_density), "da": commands}
    return FlightRecord(time, columns, "rolled")


def test_a_limit_that_large_steps_reach_is_named_with_its_size() -> None:
    (fault,) = rate_limits_of(AIRCRAFT, rolled(0.25, lambda u: followed(u, 2.5)))
    assert (fault.part, fault.kind, fault.unit) == ("aileron", "servo at its rate limit", "rad/s")
    assert fault.lower < 2.5 < fault.upper
    assert fault.size == pytest.approx(2.5, rel=0.25)


@pytest.mark.parametrize(("amplitude", "rate"), [(0.25, np.inf), (0.02, 2.5)], ids=["no limit", "not reached"])
def test_nothing_is_said_where_no_limit_is_reached(amplitude: float, rate: float) -> None:
    assert not rate_limits_of(AIRCRAFT, rolled(amplitude, lambda u: followed(u, rate)))


def test_a_limit_that_the_file_states_is_no_fault() -> None:
    stated = {"actuator_rate_limit": {"aileron": UncertainValue(2.5)}}
    assert not rate_limits_of(replace(AIRCRAFT, effects=stated), rolled(0.25, lambda u: followed(u, 2.5)))


def test_a_flight_without_flow_angles_is_not_judged() -> None:
    flight = rolled(0.25, lambda u: followed(u, 2.5))
    assert not rate_limits_of(
        AIRCRAFT, replace(flight, columns={**flight.columns, "beta": np.full(len(flight), np.nan)})
    )


@pytest.mark.parametrize("frequency", [2.5, 8.0])
@pytest.mark.parametrize("amplitude", [0.05, 0.15])
def test_a_servo_of_second_order_has_no_limit(amplitude: float, frequency: float) -> None:
    """It begins to move more softly than a lag, in proportion to the command."""
    assert not rate_limits_of(AIRCRAFT, rolled(amplitude, lambda u: of_second_order(u, frequency)))
