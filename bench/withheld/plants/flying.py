"""The loop of a flight: autopilot, actuators, airframe; from planned deflections to a log at the plant's rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from bench.withheld.plants.actuators import Actuators
from bench.withheld.plants.instruments import Log
from bench.withheld.plants.motion import Airframe, Effects, Instant
from bench.withheld.plants.pilot import RATE as PILOT_RATE
from bench.withheld.plants.pilot import Pilot

Array = NDArray[np.float64]


def fly(
    airframe: Airframe,
    effects: Effects,
    pilot: Callable[[Instant], Pilot],
    planned: Mapping[str, Array],
    gusts: Array,
    limits: Mapping[str, float],
    rate: float,
    servo: float,
) -> Log:
    """A flight of planned deflections from trim (N,) in gusts (N, 6), all at ``rate`` Hz. Raises DivergedError."""
    names, now = (*airframe.controls, "thrust"), airframe.start()
    hands = pilot(now)
    actuators = Actuators(airframe.trim, limits, effects, 1.0 / rate, servo)
    command = dict(airframe.trim)
    moments: list[Instant] = []
    commands = np.empty((len(gusts), len(names)))
    every, rows = round(rate / PILOT_RATE), gusts.tolist()
    for k in range(len(gusts)):
        if k % every == 0:
            command = hands.command({n: float(planned[n][k]) for n in names}, now)
        moments.append(now)
        commands[k] = [command[n] for n in names]
        commands[k, -1] = airframe.meter(command["thrust"])
        surfaces, thrust = actuators.move(command, k / rate)
        now = airframe.step(surfaces, thrust, rows[k], (k + 1) / rate)
    parts = [np.array(part, float) for part in zip(*moments, strict=True)]
    return Log(np.arange(len(gusts)) / rate, *parts, commands, airframe.cg)
