"""``FlightRecord``, a flight as time-aligned columns. SI units, radians, body axes forward-right-down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: The columns that a record may hold, with their units. It has one more column for each further control.
COLUMNS = {
    "ax": "specific force, body x, m/s^2",
    "ay": "specific force, body y, m/s^2",
    "az": "specific force, body z, m/s^2 (about -9.8 in level flight)",
    "p": "roll rate, rad/s",
    "q": "pitch rate, rad/s",
    "r": "yaw rate, rad/s",
    "phi": "roll angle, rad",
    "theta": "pitch angle, rad",
    "psi": "heading, rad",
    "V": "true airspeed, m/s",
    "alpha": "angle of attack, rad",
    "beta": "sideslip, rad",
    "rho": "air density, kg/m^3",
    "thrust": "thrust, N",
    "de": "elevator, rad",
    "da": "aileron, rad",
    "dr": "rudder, rad",
}

#: No step of fewer usual ones than this is an interruption, however slow the record is.
USUAL_STEPS = 5.0


@dataclass(frozen=True)
class FlightRecord:
    """A flight with one time base.

    ``time`` (N,) s, strictly increasing, usually from zero; ``columns`` name -> (N,), NaN = not measured.
    ``start_ns`` is the header stamp (ns) at ``time == 0``. ``rejected`` counts messages left out, by reason.
    Raises ValueError where times do not increase or lengths differ.
    """

    time: Array
    columns: Mapping[str, Array]
    name: str = ""
    start_ns: int = 0
    rejected: Mapping[str, int] = field(default_factory=dict)
    commanded: bool = False  # whether the controls follow from commands by the aircraft file's servos
    air_interval: float = 0.0  # s between the messages of air data, on average; 0 = not known
    command_interval: float = 0.0  # s between a log's commands where lines stand between them (``JointStream``)

    def __post_init__(self) -> None:
        if self.time.ndim != 1 or self.time.size < 2:
            raise ValueError(f"flight {self.name!r}: {self.time.size} samples; at least 2 are needed")
        step = np.diff(self.time)
        if not np.all(step > 0):
            i = int(np.argmin(step > 0))
            raise ValueError(
                f"flight {self.name!r}: time must increase; sample {i + 1} at {self.time[i + 1]:.6f} s "
                f"follows {self.time[i]:.6f} s"
            )
        for column, values in self.columns.items():
            if values.shape != self.time.shape:
                raise ValueError(
                    f"flight {self.name!r}: column {column!r} has {values.size} values for {self.time.size} times"
                )

    def __getitem__(self, column: str) -> Array:
        """The column (N,); all NaN where it was not measured."""
        if column in self.columns:
            return self.columns[column]
        return np.full(self.time.shape, np.nan)

    def __len__(self) -> int:
        return int(self.time.size)

    @property
    def duration(self) -> float:
        """Seconds from the first to the last sample."""
        return float(self.time[-1] - self.time[0])

    def measured(self, column: str) -> bool:
        """Whether the column holds any finite value."""
        return bool(np.isfinite(self[column]).any())

    def between(self, start: float, stop: float) -> FlightRecord:
        """The part with start <= time < stop (s), on the same clock."""
        keep = (self.time >= start) & (self.time < stop)
        columns = {name: values[keep] for name, values in self.columns.items()}
        return replace(self, time=self.time[keep], columns=columns)


def rows_with_values(record: FlightRecord, names: Sequence[str]) -> tuple[NDArray[np.bool_], list[str]]:
    """(N,) whether a sample has a value of each of these columns, and the columns that lack some.

    Columns that were never measured do not count.
    """
    measured = [name for name in names if record.measured(name)]
    there = np.isfinite(np.array([record.time, *(record[name] for name in measured)]))
    return there.all(axis=0), [name for name, values in zip(measured, there[1:], strict=True) if not values.all()]


def lacking_in_words(complete: NDArray[np.bool_], names: Sequence[str]) -> str:
    """How many samples are not ``complete`` (N,), because a value of one of these columns is missing."""
    return f"{int((~complete).sum())} of {complete.size} samples lack a value of {', '.join(names)}"


def uninterrupted_parts(time: Array, longest: float) -> list[slice]:
    """The parts of times (N,) between interruptions: steps longer than ``longest`` s, and than five usual ones."""
    steps = np.diff(time)
    limit = max(USUAL_STEPS * float(np.median(steps)), longest) if steps.size else longest
    edges = [0, *(np.flatnonzero(steps > limit) + 1).tolist(), time.size]
    return [slice(first, last) for first, last in pairwise(edges)]


def interrupted_in_words(parts: int) -> str:
    """How often a recording is interrupted that consists of so many ``parts``, two or more."""
    often = "once" if parts == 2 else f"{parts - 1} times"
    return f"the recording is interrupted {often}"
