"""Parameters of nodes as tables, which declare, describe and check them and write the files in config/."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sysid_node.errors import InputError


@dataclass(frozen=True)
class NodeParameter:
    """One parameter. ``lower`` and ``upper`` are inclusive; ``choices``, where given, are all allowed values."""

    name: str
    default: Any
    unit: str  # "" = none
    meaning: str
    change: str  # when to change it
    lower: float = -math.inf
    upper: float = math.inf
    choices: tuple[str, ...] = ()

    @property
    def constraint(self) -> str:
        """The allowed values in words; empty where every value of the type is allowed."""
        if self.choices:
            return " | ".join(self.choices)
        if isinstance(self.default, float):
            return f"{self.lower:g} to {self.upper:g}{f' {self.unit}' if self.unit else ''}"
        return ""

    @property
    def expected(self) -> str:
        """What a value must be, as the end of an error message."""
        kind = {bool: "true or false", str: "a string", float: "a double", list: "a list of doubles"}
        allowed = f", {self.constraint}" if self.constraint else ""
        return f"{kind[type(self.default)]}{allowed}, e.g. {_yaml(self.default)}"


#: Parameters that several nodes have.
AIRCRAFT = NodeParameter(
    "aircraft",
    "",
    "",
    "The aircraft: a name in config/aircraft, e.g. cdrw, or the path of an aircraft file. Needed.",
    "For every aircraft.",
)
BODY_FRAME = NodeParameter(
    "body_frame",
    "flu",
    "",
    "Axes of imu/data: flu is forward-left-up (REP-103), frd is forward-right-down.",
    "Where the autopilot's driver publishes the IMU in forward-right-down axes.",
    choices=("flu", "frd"),
)


def setting(
    defaults: object, ranges: Mapping[str, tuple[float, float]], name: str, unit: str, meaning: str, change: str
) -> NodeParameter:
    """The parameter for the field ``name`` of a dataclass of settings, with the field's default and range."""
    return NodeParameter(name, float(getattr(defaults, name)), unit, meaning, change, *ranges[name])


def check_each(table: Sequence[NodeParameter], values: Mapping[str, Any]) -> None:
    """Check the value of every parameter of the table. Raises InputError that names the first wrong one."""
    for parameter in table:
        value = values[parameter.name]
        unknown = parameter.choices and value not in parameter.choices
        if unknown or (isinstance(parameter.default, float) and not parameter.lower <= value <= parameter.upper):
            raise InputError(f"parameter {parameter.name} = {value!r}: expected {parameter.expected}")


def annotated_yaml(node: str, table: Sequence[NodeParameter], effect: str) -> str:
    """The text of config/<node>.yaml: every parameter with meaning, unit, default and when to change it.

    ``effect`` says when a change takes effect.
    """
    lines = [
        f"# Parameters of the node `{node}`. Every value here is the default; leave out what you do not change.",
        f"# ros2 run sysid_node {node} --ros-args --params-file {node}.yaml -p aircraft:=cdrw",
        f"# {effect}",
        "",
        "/**:",
        "  ros__parameters:",
    ]
    for parameter in table:
        values = f"Values: {parameter.constraint}." if parameter.constraint else ""
        unit = f"Unit: {parameter.unit}." if parameter.unit and not values else ""
        notes = (note for note in (parameter.meaning, values, unit, f"Change: {parameter.change}") if note)
        for note in notes:
            lines += textwrap.wrap(note, 110, initial_indent="    # ", subsequent_indent="    #   ")
        lines += [f"    {parameter.name}: {_yaml(parameter.default)}", ""]
    return "\n".join(lines)


def _yaml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    return str(value)
