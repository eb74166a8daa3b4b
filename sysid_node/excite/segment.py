"""Segments, each one kind of input on some controls, and the manoeuvre that several of them make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.excite.kinds import COMMON_KEYS, KINDS
from sysid_node.excite.manoeuvre import Manoeuvre, check_limits, control_limits

Array = NDArray[np.float64]

#: Seconds of free response after the last segment, where the caller gives no duration.
TAIL = 3.0


_MOST_SAMPLES = 5_000_000

#: Samples of the shortest step.
_STEP_SAMPLES = 2


@dataclass(frozen=True)
class ManoeuvreSegment:
    """One term of a spec: a kind on some controls, with an amplitude each and its other numbers."""

    kind: str
    controls: tuple[str, ...]
    amplitude: tuple[float, ...]  # one per control
    values: Mapping[str, float]  # every key of the kind and of COMMON_KEYS
    source: str = field(default="", compare=False)  # the term as the user wrote it; empty where nobody did

    @property
    def length(self) -> float:
        """Seconds that one flight of it lasts."""
        return KINDS[self.kind].length(self.values)

    @property
    def period(self) -> float:
        """Seconds from one repetition to the next."""
        return self.values["every"] or self.length + 1.0

    @property
    def end(self) -> float:
        """The end of the last repetition, s."""
        return self.values["start"] + (int(self.values["repeat"]) - 1) * self.period + self.length

    def draw(self, time: Array) -> Array:
        """Deflections (controls, N) at the times."""
        total = np.zeros((len(self.controls), time.size))
        for i in range(int(self.values["repeat"])):
            local = time - self.values["start"] - i * self.period
            try:
                total += KINDS[self.kind].draw(local, self.values, len(self.controls))
            except InputError as error:
                raise InputError(f"manoeuvre {as_written([self])!r}: {error}") from error
        return np.array(self.amplitude)[:, None] * total

    def text(self) -> str:
        """The spec of the segment, from which ``parse_segments`` makes it again."""
        amplitude = ",".join(f"{value:g}" for value in self.amplitude)
        known = {**KINDS[self.kind].keys, **COMMON_KEYS}
        rest = [f"{key}={value:g}" for key, value in self.values.items() if value != known[key].default]
        return ":".join([self.kind, ",".join(self.controls), f"amplitude={amplitude}", *rest])


def as_written(segments: Sequence[ManoeuvreSegment]) -> str:
    """The spec of segments as the user wrote it, for messages: a term that moves controls in turn is one."""
    return "+".join(dict.fromkeys(segment.source or segment.text() for segment in segments))


def moved(segment: ManoeuvreSegment, start: float) -> ManoeuvreSegment:
    """The same segment at another time (s)."""
    return replace(segment, values={**segment.values, "start": start})


def draw_manoeuvre(
    segments: Sequence[ManoeuvreSegment], aircraft: Aircraft, rate: float = 100.0, duration: float | None = None
) -> Manoeuvre:
    """The segments as one manoeuvre, sampled at ``rate`` (Hz) for ``duration`` (s); see ``parse_manoeuvre``.

    Raises InputError where the flight is too short for them, or a deflection passes its control's limit.
    """
    time = _time_base(segments, rate, duration)
    deflections = {name: np.zeros(time.size) for name in control_limits(aircraft)}
    for segment in segments:
        for control, values in zip(segment.controls, segment.draw(time), strict=True):
            deflections[control] += values
    spec = "+".join(segment.text() for segment in segments)
    manoeuvre = Manoeuvre(time, deflections, spec, as_written(segments))
    check_limits(manoeuvre, aircraft)
    return manoeuvre


def check_sampling(segments: Sequence[ManoeuvreSegment], rate: float) -> None:
    """Raise InputError where a step is shorter than two samples at a rate (Hz), or a frequency above half of it.

    It would be drawn as another one.
    """
    for segment in segments:
        highest = segment.values.get("high", 0.0)
        if highest > rate / 2:
            raise InputError(
                f"manoeuvre {as_written([segment])!r}: {highest:g} Hz cannot be drawn at {rate:g} Hz; sample at least "
                "twice as fast, or lower high"
            )
        width = segment.values.get("width")
        if width is not None and width * rate < _STEP_SAMPLES - 1e-9:
            raise InputError(
                f"manoeuvre {as_written([segment])!r}: steps of {width:g} s cannot be drawn at {rate:g} Hz; make them "
                f"at least {_STEP_SAMPLES / rate:g} s long"
            )


def _time_base(segments: Sequence[ManoeuvreSegment], rate: float, duration: float | None) -> Array:
    spec, end = as_written(segments), max(segment.end for segment in segments)
    total = end + TAIL if duration is None else duration
    if total < end - 1e-9:
        raise InputError(f"manoeuvre {spec!r}: lasts until {end:g} s, but the flight {total:g} s; fly longer")
    if not 1.0 <= rate <= 10_000.0 or not total * rate <= _MOST_SAMPLES:
        raise InputError(
            f"manoeuvre {spec!r}: {total:g} s at {rate:g} Hz; expected 1 to 10000 Hz, at most {_MOST_SAMPLES} samples"
        )
    check_sampling(segments, rate)
    return np.asarray(np.arange(round(total * rate) + 1) / rate)
