"""How a JSBSim model's thrust follows its throttle near a steady flight: its direction and its lag."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.sim.effects import command_delay
from sysid_node.sim.importing.jsbsim.program import Flight, Program

Array = NDArray[np.float64]

#: Change of the throttle from the steady flight's, both ways: a turbine changes its speed at a steady rate, and an
#: ordinary flight moves the throttle little.
_STEP = 0.02

#: How long the engine runs before a step of the throttle and is watched after it, s, and how often, Hz.
_RUNNING, _WATCHED, _RATE = 0.2, 6.0, 50.0

#: Shares of a step at which its answer is timed.
_SHARES = (1.0 - math.exp(-1.0 / 3.0), 1.0 - math.exp(-1.0))

#: Lags and delays below this count as none, s; the longest delay is that which an aircraft file can state.
_SHORTEST, _LONGEST = 0.02, command_delay.LONGEST


@dataclass(frozen=True)
class Engine:
    """Thrust in the steady flight (N), its angle above the x axis (rad), its arm (m), its delay and its lag (s)."""

    thrust: float
    inclination: float = 0.0
    arm: float = 0.0
    delay: float = 0.0
    lag: float = 0.0


def engine_of(program: Program, state: Flight, steady: Array) -> Engine:
    """The engine near a steady flight, whose load by the engine (6,) is ``steady``; no thrust: unpowered."""
    thrust = math.hypot(steady[0], steady[2]) if program.powered else 0.0
    if thrust <= 0.0:
        return Engine(0.0)
    engine = Engine(thrust, math.atan2(-steady[2], steady[0]), float(steady[4]) / thrust)
    if not program.engines:
        return engine
    delay, lag = _answer(program, state)
    return replace(engine, delay=delay, lag=lag)


def _answer(program: Program, state: Flight) -> tuple[float, float]:
    """Delay and time constant (s) with which the thrust follows a step of the throttle.

    They are those of the first-order lag with delay that has done 28.3 and 63.2 % of what the step does in the end at
    the same times: C. L. Smith (1972), "Digital Computer Process Control". Of an engine that is later than a file can
    state the lag is as much longer, so that 63.2 % are done at the same time.
    """
    low, high = max(state.throttle - _STEP, 0.0), min(state.throttle + _STEP, 1.0)
    flown = [_course(program, state, low, throttle) for throttle in (low, high)]
    change = flown[1] - flown[0]  # the airspeed falls in both flights alike
    if change[-1] <= 0.0:
        return 0.0, 0.0
    early, late = (float(np.argmax(change >= share * change[-1])) / _RATE for share in _SHARES)
    lag = 1.5 * (late - early)
    delay = late - lag
    if not _SHORTEST < delay < _LONGEST:
        delay = 0.0 if delay <= _SHORTEST else _LONGEST
        lag = late - delay
    return delay, lag if lag > _SHORTEST else 0.0


def _course(program: Program, state: Flight, before: float, after: float) -> Array:
    """Thrust (N,) in flight from steady running at one throttle, with another from the first moment on."""
    program.put(replace(state, throttle=before), {})
    program.run_for(_RUNNING)  # JSBSim's turbine follows the first throttle in flight at once
    program.levers(after)
    thrust = []
    for _ in range(round(_WATCHED * _RATE)):
        thrust.append(program.loads().engine[0])
        program.run_for(1.0 / _RATE)
    return np.array(thrust)
