"""A table's controls as commands: the deflections that follow from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.commanded import commands_of, deflections, known_from, take_command, with_excess
from sysid_node.flight.record import FlightRecord


def with_commands(aircraft: Aircraft, flight: FlightRecord, carried: str) -> FlightRecord:
    """The flight with the deflections that follow from its controls where these are commands, held between samples."""
    symbols = [symbol for symbol in aircraft.control_symbols if flight.measured(symbol)]
    stamps = np.round(flight.time * 1e9).astype(np.int64)
    if carried == "auto" and symbols:
        known = known_from(stamps, np.nan_to_num(np.column_stack([flight[symbol] for symbol in symbols])))
        carried = "positions" if known is None else "commands"
    commands = commands_of(aircraft, carried)
    if commands is None:
        return flight
    names = ("thrust", *aircraft.control_symbols)
    rows = []
    for stamp, row in zip(stamps.tolist(), np.column_stack([flight[name] for name in names]).tolist(), strict=True):
        take_command(commands, 0, stamp, row)
        rows.append(deflections(commands, 0, stamp, row))
    moved = np.array(rows)
    columns = [moved[:, 0], *with_excess(stamps, moved[:, 1:]).T]
    followed = {name: column for name, column in zip(names, columns, strict=True) if name in flight.columns}
    return replace(flight, columns={**flight.columns, **followed}, commanded=True)
