"""A flight of the kestrel behind servos that its file does not know, recorded by its commands."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from made_flight import flight

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.record import FlightRecord

UNCERTAIN = load_aircraft("kestrel")
LATE = 0.04  # s


NOISE = 0.1  # of the file's sensors: the flight is short


@cache
def behind_servos(seed: int) -> FlightRecord:
    """A flight whose controls were recorded before servos of first order, and not behind them."""
    record = flight(seed, NOISE)
    step, columns = record.time[1] - record.time[0], dict(record.columns)
    for name in ("de", "da", "dr"):
        # the command that is linear between samples and makes the servo's position so, too
        columns[name] = columns[name] + LATE * np.gradient(columns[name], step)
    return replace(record, columns=columns)
