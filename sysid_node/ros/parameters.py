"""Parameters of nodes: one table declares, describes and checks them, and writes config/identifier.yaml."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from sysid_node.errors import InputError
from sysid_node.online.settings import METHODS, Settings


@dataclass(frozen=True)
class Parameter:
    """One node parameter. ``lower`` and ``upper`` are inclusive; ``choices`` are all that is allowed."""

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
        """The allowed values in words; empty where any value of the type will do."""
        if self.choices:
            return " | ".join(self.choices)
        if isinstance(self.default, float):
            return f"{self.lower:g} to {self.upper:g}{f' {self.unit}' if self.unit else ''}"
        return ""

    @property
    def expected(self) -> str:
        """What a value must be, in words that end an error message."""
        kind = {bool: "true or false", str: "a string", float: "a double", list: "a list of doubles"}
        allowed = f", {self.constraint}" if self.constraint else ""
        return f"{kind[type(self.default)]}{allowed}, e.g. {_yaml(self.default)}"


def setting(
    defaults: object, ranges: Mapping[str, tuple[float, float]], name: str, unit: str, meaning: str, change: str
) -> Parameter:
    """The parameter that sets the field ``name`` of a dataclass of settings, within its range."""
    return Parameter(name, float(getattr(defaults, name)), unit, meaning, change, *ranges[name])


_ESTIMATOR = Settings()

PARAMETERS = (
    Parameter(
        "aircraft",
        "",
        "",
        "The aircraft: a name in config/aircraft, e.g. cdrw, or the path of an aircraft file. Needed.",
        "For every aircraft.",
    ),
    Parameter(
        "body_frame",
        "flu",
        "",
        "Axes of imu/data: flu is forward-left-up (REP-103), frd is forward-right-down.",
        "Where the autopilot's driver publishes the IMU in forward-right-down axes.",
        choices=("flu", "frd"),
    ),
    Parameter(
        "publish_rate",
        20.0,
        "Hz",
        "Estimates published per second of flight, by the stamps of the data; the estimator itself takes every sample.",
        "Up for a controller that adapts quickly, down for a slow radio link.",
        lower=0.01,
        upper=1000.0,
    ),
    Parameter(
        "stale_after",
        0.5,
        "s",
        "A topic silent for longer is reported as stale on /diagnostics.",
        "Up where a sensor publishes more slowly than twice a second.",
        lower=0.01,
        upper=3600.0,
    ),
    Parameter(
        "save_directory",
        ".",
        "",
        "Folder that ~/save writes estimates into; made where it is missing. May change at any time.",
        "To keep estimates where they survive the flight.",
    ),
    Parameter(
        "autostart",
        True,
        "",
        "Configure and activate at the start; an unusable parameter then ends the process. false: wait for requests.",
        "false where a lifecycle manager starts the nodes in order.",
    ),
    Parameter(
        "frequencies",
        list(_ESTIMATOR.frequencies),
        "Hz",
        "Lines of the Fourier transform: first, step, last. Motion outside this band is left out.",
        "Last: above short period and Dutch roll, below structural modes and noise. First: above slow drift.",
    ),
    Parameter(
        "method",
        _ESTIMATOR.method,
        "",
        "sls_rft: least squares. iv_rft: instrumental variables, unbiased by noise on the flow angles, less precise.",
        "iv_rft where vanes are noisy beside the motion or the air is turbulent; sls_rft where neither is.",
        choices=METHODS,
    ),
    Parameter(
        "forgetting_time",
        _ESTIMATOR.forgetting_time,
        "s",
        "Older data count e^-1 after this time; 0 = nothing is forgotten.",
        "30 to 120 where the aircraft changes slowly (fuel, speed, icing). Not together with window.",
        lower=0.0,
        upper=86400.0,
    ),
    Parameter(
        "window",
        _ESTIMATOR.window,
        "s",
        "Only the last so many seconds count; 0 = the whole record.",
        "Where old data must be gone for certain rather than fade. Not together with forgetting_time.",
        lower=0.0,
        upper=86400.0,
    ),
    Parameter(
        "settle_time",
        _ESTIMATOR.settle_time,
        "s",
        "Left out at the start, while filters settle.",
        "Up where the sensors' own filters start slowly.",
        lower=0.0,
        upper=3600.0,
    ),
    Parameter(
        "max_gap",
        _ESTIMATOR.max_gap,
        "s",
        "The longest gap in air data or actuators across which samples are interpolated.",
        "Up where air data come at less than 10 Hz.",
        lower=0.001,
        upper=5.0,
    ),
    Parameter(
        "use_prior",
        _ESTIMATOR.use_prior,
        "",
        "Whether the aircraft file's derivatives count as measurements, each by its tolerance.",
        "true where early estimates matter and the file is trusted.",
    ),
    Parameter(
        "detect_changes",
        _ESTIMATOR.detect_changes,
        "",
        "Whether to look for abrupt changes of the aircraft, and to forget what was before.",
        "false to average over the whole flight whatever happens.",
    ),
    Parameter(
        "valid_fraction",
        _ESTIMATOR.valid_fraction,
        "",
        "A derivative is valid once its standard error is under this share of its size.",
        "Down for a controller that needs precise values, up for one that needs them early.",
        lower=0.001,
        upper=100.0,
    ),
)

_ESTIMATION = frozenset(field.name for field in fields(Settings))

#: Parameters that may change while the node is configured.
LIVE = frozenset({"save_directory", "stale_after"})


def estimation_settings(values: Mapping[str, Any]) -> Settings:
    """The estimator's part of all parameters. Raises InputError on an impossible combination."""
    return Settings.from_mapping({name: value for name, value in values.items() if name in _ESTIMATION})


def check(values: Mapping[str, Any]) -> None:
    """Check values of all parameters. Raises InputError naming the first wrong one, what it is and what is expected."""
    check_each(PARAMETERS, values)
    estimation_settings(values)


def check_each(table: Sequence[Parameter], values: Mapping[str, Any]) -> None:
    """Check values one by one. Raises InputError naming the first wrong one."""
    for parameter in table:
        value = values[parameter.name]
        unknown = parameter.choices and value not in parameter.choices
        if unknown or (isinstance(parameter.default, float) and not parameter.lower <= value <= parameter.upper):
            raise InputError(f"parameter {parameter.name} = {value!r}: expected {parameter.expected}")


IDENTIFIER_EFFECT = (
    "They take effect when the node is configured; to change one later: ros2 lifecycle set /identifier cleanup."
)


def annotated_yaml(
    node: str = "identifier", table: Sequence[Parameter] = PARAMETERS, effect: str = IDENTIFIER_EFFECT
) -> str:
    """The text of config/<node>.yaml: every parameter with meaning, unit, default and when to change it."""
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


if __name__ == "__main__":
    print(annotated_yaml(), end="")
