"""What can be set of the online estimator: one table for node parameters, ``--set`` and tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, get_type_hints

from sysid_node.errors import InputError
from sysid_node.flight.align import MAX_GAP
from sysid_node.flight.commanded import CARRIED
from sysid_node.setting import check_frequencies, parse_setting
from sysid_node.suggestion import did_you_mean

METHODS = ("sls_rft", "iv_rft")
MOST_LINES = 1000
LONGEST_GAP = 5.0  # s
#: Before so much flight, s, nothing is estimated.
FIRST_ESTIMATE = 1.0

SHORTEST_MEMORY, LONGEST_MEMORY = 1.0, 1e6  # s


def too_short_to_replay(flight: str, seconds: float) -> str:
    """The message that a flight holds no estimate."""
    first = f"the first estimate comes after {FIRST_ESTIMATE:g} s"
    return f"{flight}: {seconds:.2g} s of flight; {first}; give a longer flight"


@dataclass(frozen=True)
class OnlineSettings:
    """Settings of the online estimator. Defaults suit UAVs of 1 to 20 kg. Raises InputError on impossible values."""

    frequencies: tuple[float, float, float] = (0.1, 0.04, 2.0)  # Hz: first line, step, last line
    method: str = "iv_rft"  # "iv_rft" instrumental variables, "sls_rft" least squares
    forgetting_time: float = 0.0  # s: older data count e^-1; 0 = nothing is forgotten
    window: float = 0.0  # s: only the last so many seconds count; 0 = the whole record
    settle_time: float = 0.5  # s left out at the start, while filters and pilots settle
    max_gap: float = MAX_GAP  # s: the longest gap in the data that is bridged by interpolation
    actuators: str = "auto"  # what the topic actuators carries: "commands", "positions", or "auto", by the messages
    use_prior: bool = False  # whether the aircraft file's derivatives count, by their tolerances
    detect_changes: bool = True  # forget what was before an abrupt change of the aircraft
    valid_fraction: float = 0.3  # a derivative is valid once its standard error is under this share of its file's size

    def __post_init__(self) -> None:
        check_frequencies(self.frequencies)
        start, step, stop = self.frequencies
        if (stop - start) / step > MOST_LINES:
            raise InputError(f"frequencies {start}:{step}:{stop}: expected at most {MOST_LINES} lines; widen the step")
        if self.method not in METHODS:
            raise InputError(f"method {self.method!r}: expected one of {', '.join(METHODS)}")
        if self.actuators not in CARRIED:
            raise InputError(f"actuators {self.actuators!r}: expected one of {', '.join(CARRIED)}")
        for name in ("forgetting_time", "window", "settle_time"):
            value = getattr(self, name)
            if not 0.0 <= value <= LONGEST_MEMORY:
                raise InputError(f"{name} {value}: expected seconds, zero or more and at most {LONGEST_MEMORY:g}")
        if 0.0 < self.forgetting_time < SHORTEST_MEMORY:
            raise InputError(f"forgetting_time {self.forgetting_time}: expected 0 or at least {SHORTEST_MEMORY:g} s")
        if self.forgetting_time and self.window:
            raise InputError("forgetting_time and window: expected one of them at most; leave the other at 0")
        if not 0.0 < self.max_gap <= LONGEST_GAP:
            raise InputError(f"max_gap {self.max_gap}: expected seconds, more than 0 and at most {LONGEST_GAP:g}")
        if not self.valid_fraction > 0.0:
            raise InputError(f"valid_fraction {self.valid_fraction}: expected a positive fraction")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> OnlineSettings:
        """From node parameters or ``--set key=value`` texts. Raises InputError naming the wrong key or value."""
        types = get_type_hints(cls)
        for key in values:
            if key not in types:
                raise InputError(f"setting {key!r} is not known; known: {', '.join(types)}{did_you_mean(key, types)}")
        return cls(**{key: parse_setting(key, types[key], value) for key, value in values.items()})

    def as_dict(self) -> dict[str, Any]:
        """Plain values by name, for ``summary.json``."""
        return {f.name: getattr(self, f.name) for f in fields(self)}
