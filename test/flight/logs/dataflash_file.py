"""Writes small DataFlash files, by the format's description (ardupilot.org, binary log format; FMT is message 128)."""

import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

_CODES = {"Q": "Q", "f": "f", "B": "B", "H": "H", "M": "B", "N": "16s", "Z": "64s", "n": "4s", "I": "I"}


class Kind(NamedTuple):
    """A message type: the letters of its fields, and their names."""

    letters: str
    columns: tuple[str, ...]


KINDS = {
    "FMT": Kind("BBnNZ", ("Type", "Length", "Name", "Format", "Columns")),
    "MSG": Kind("QZ", ("TimeUS", "Message")),
    "PARM": Kind("QNf", ("TimeUS", "Name", "Value")),
    "IMU": Kind("QBffffff", ("TimeUS", "I", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ")),
    "ATT": Kind("Qfff", ("TimeUS", "Roll", "Pitch", "Yaw")),
    "ARSP": Kind("QBfBB", ("TimeUS", "I", "Airspeed", "H", "Pri")),
    "BARO": Kind("QBffff", ("TimeUS", "I", "Alt", "Press", "Temp", "GndTemp")),
    "RCOU": Kind("QHHHHHH", ("TimeUS", "C1", "C2", "C3", "C4", "C5", "C6")),
    "STAT": Kind("QBB", ("TimeUS", "isFlying", "Armed")),
    "MODE": Kind("QMB", ("TimeUS", "Mode", "ModeNum")),
    "GPS": Kind("QIH", ("TimeUS", "GMS", "GWk")),
    "XKF4": Kind("QBB", ("TimeUS", "C", "PI")),
    "AOA": Kind("Qff", ("TimeUS", "AOA", "SSA")),
}


Rows = Mapping[str, Sequence[Sequence[Any]]]
Clock = Callable[[int], int]


def write_dataflash(path: Path, rows: Rows, clock: Clock = int) -> None:
    """A binary DataFlash file with the rows of each kind in the order of their times, after all FMT messages.

    ``clock`` gives the stamp of a time.
    """
    numbers = {name: 128 + i for i, name in enumerate(KINDS)}
    body = bytearray()
    for name, kind in KINDS.items():
        length = struct.calcsize(_layout(kind.letters)) + 3
        formats = (numbers[name], length, name, kind.letters, ",".join(kind.columns))
        body += _row(128, KINDS["FMT"].letters, formats)
    every = [(row[0], name, row) for name, of_kind in rows.items() for row in of_kind]
    for _, name, row in sorted(every, key=lambda one: one[0]):
        body += _row(numbers[name], KINDS[name].letters, (clock(row[0]), *row[1:]))
    path.write_bytes(body)


def write_dataflash_text(path: Path, rows: Rows, clock: Clock = int) -> None:
    """The same as text, as ArduPilot's ground stations and MAVExplorer write it: fields behind ", ", a line each."""
    numbers = {name: 128 + i for i, name in enumerate(KINDS)}
    lines = [
        f"FMT, {numbers[name]}, {struct.calcsize(_layout(kind.letters)) + 3}, {name}, {kind.letters}, "
        + ",".join(kind.columns)
        for name, kind in KINDS.items()
    ]
    every = [(row[0], name, row) for name, of_kind in rows.items() for row in of_kind]
    lines += [
        ", ".join([name, str(clock(row[0])), *map(str, row[1:])])
        for _, name, row in sorted(every, key=lambda one: one[0])
    ]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def _layout(letters: str) -> str:
    return "<" + "".join(_CODES[letter] for letter in letters)


def _row(number: int, letters: str, row: Sequence[Any]) -> bytes:
    cells = [cell.encode() if isinstance(cell, str) else cell for cell in row]
    return b"\xa3\x95" + bytes([number]) + struct.pack(_layout(letters), *cells)
