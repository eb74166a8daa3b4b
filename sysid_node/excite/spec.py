"""Manoeuvres from text: ``kind[:control,...][:key=value...]``, several of these joined by ``+``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.excite.kinds import COMMON_KEYS, KINDS, ManoeuvreKey
from sysid_node.excite.manoeuvre import THROTTLE, Manoeuvre, control_limits
from sysid_node.excite.segment import ManoeuvreSegment, draw_manoeuvre
from sysid_node.suggestion import did_you_mean

Array = NDArray[np.float64]

#: Seconds between controls that are moved in turn.
PAUSE = 2.0
#: Share of a control's limit that is its amplitude, where none is given.
DEFAULT_SHARE = 0.15
#: Share of the throttle's way from level flight to its nearer end that its amplitude is at most, where none is given.
_ROOM = 0.9

#: Largest seed: larger ones are no longer told apart as floating-point numbers.
_LARGEST_SEED = 2**53

#: A plus sign joins segments where a kind follows it; in a number such as 1e+1 it does not.
_JOIN = re.compile(rf"\+(?=\s*(?:{'|'.join(KINDS)})\s*(?::|\+|$))")


def parse_manoeuvre(
    spec: str | Sequence[str],
    aircraft: Aircraft,
    rate: float = 100.0,
    duration: float | None = None,
) -> Manoeuvre:
    """The manoeuvre that a spec, or several flown together, describes for this aircraft.

    Sampled at ``rate`` (Hz) for ``duration`` (s; until 3 s after the last segment where it is None). Raises InputError
    (one line) for a spec that is wrong, a control that the aircraft does not have, or a deflection beyond its limit.
    """
    return draw_manoeuvre(parse_segments(spec, aircraft), aircraft, rate, duration)


def parse_segments(
    spec: str | Sequence[str], aircraft: Aircraft, airspeed: float | None = None
) -> tuple[ManoeuvreSegment, ...]:
    """The segments of a spec or of several, checked. Raises InputError.

    The throttle's amplitude, where none is given, stays within what level flight at ``airspeed`` (m/s; None: the
    reference) leaves.
    """
    texts = [spec] if isinstance(spec, str) else list(spec)
    parts = (part.strip() for text in texts for part in _JOIN.split(text))
    return tuple(segment for part in parts for segment in _term(part, aircraft, airspeed))


def _term(text: str, aircraft: Aircraft, airspeed: float | None) -> list[ManoeuvreSegment]:
    """The segments of one term; without controls it moves all surfaces, in turn unless its inputs are orthogonal."""
    kind, _, rest = text.partition(":")
    kind = kind.strip()
    if kind not in KINDS:
        raise _error(text, f"{kind!r} is no kind of manoeuvre; expected one of {', '.join(KINDS)}", kind, KINDS)
    names, _, settings = ("", "", rest) if "=" in rest.partition(":")[0] else rest.partition(":")
    segment = _segment(text, kind, _controls(text, names, aircraft), settings, aircraft, airspeed)
    return [segment] if names or KINDS[kind].orthogonal else _in_turn(segment)


def _segment(
    text: str, kind: str, controls: tuple[str, ...], settings: str, aircraft: Aircraft, airspeed: float | None
) -> ManoeuvreSegment:
    given = _settings(text, settings)
    known = {**KINDS[kind].keys, **COMMON_KEYS}
    expected = dict.fromkeys(("amplitude", *known))
    for key in given:
        if key not in expected:
            raise _error(text, f"{key!r} is no key of {kind}; expected {', '.join(expected)}", key, expected)
    values = {key: _number(text, key, given.get(key), default) for key, default in known.items()}
    _check(text, values)
    length = KINDS[kind].length(values)
    if values["repeat"] > 1 and 0.0 < values["every"] < length * (1.0 - 1e-9):
        raise _error(text, f"every is {values['every']:g} s, but it lasts {length:g} s; begin again after its end")
    said = given.get("amplitude")
    if said is None:
        usual = tuple(_usual_amplitude(text, control, aircraft, airspeed) for control in controls)
        return ManoeuvreSegment(kind, controls, usual, values, text)
    return ManoeuvreSegment(kind, controls, _amplitude(text, said, controls), values, text)


def _in_turn(segment: ManoeuvreSegment) -> list[ManoeuvreSegment]:
    """A segment for each control, one after the other; all come before the first is repeated."""
    step = segment.length + PAUSE
    every = segment.values["every"] or step * len(segment.controls)
    return [
        replace(
            segment,
            controls=(control,),
            amplitude=(amplitude,),
            values={**segment.values, "start": segment.values["start"] + i * step, "every": every},
        )
        for i, (control, amplitude) in enumerate(zip(segment.controls, segment.amplitude, strict=True))
    ]


def _error(text: str, problem: str, word: str = "", known: Mapping[str, object] | None = None) -> InputError:
    return InputError(f"manoeuvre {text!r}: {problem}{did_you_mean(word, known) if known else ''}")


def _controls(text: str, names: str, aircraft: Aircraft) -> tuple[str, ...]:
    limits = control_limits(aircraft)
    if not names:
        surfaces = tuple(name for name in limits if name != THROTTLE)
        if not surfaces:
            raise _error(text, f"{aircraft.name} has no surfaces that it could move")
        return surfaces
    if not limits:
        raise _error(text, f"{aircraft.name} has no controls")
    controls = tuple(name.strip() for name in names.split(","))
    for name in controls:
        if name not in limits:
            listed = ", ".join(limits)
            raise _error(text, f"{aircraft.name} has no control {name!r}; expected one of {listed}", name, limits)
    if len(set(controls)) < len(controls):
        raise _error(text, "a control is named twice")
    return controls


def _settings(text: str, settings: str) -> dict[str, str]:
    given: dict[str, str] = {}
    for item in filter(None, (part.strip() for part in settings.split(":"))):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals:
            raise _error(text, f"got {item!r}, expected key=value")
        if key in given:
            raise _error(text, f"{key} is given twice")
        given[key] = value
    return given


def _float(text: str, key: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise _error(text, f"{key} is {value!r}, expected a number")
    return number


def _number(text: str, key: str, value: str | None, known: ManoeuvreKey) -> float:
    number = known.default if value is None else _float(text, key, value)
    if number < 0 or (known.positive and number == 0):
        bound = "above zero" if known.positive else "not negative"
        raise _error(text, f"{key} is {number:g}, expected {bound}{f' ({known.unit})' if known.unit else ''}")
    return number


def _amplitude(text: str, value: str, controls: tuple[str, ...]) -> tuple[float, ...]:
    count = len(controls)
    amplitude = tuple(_float(text, "amplitude", part) for part in value.split(","))
    if len(amplitude) == 1:
        amplitude *= count
    if len(amplitude) != count:
        raise _error(text, f"{len(amplitude)} amplitudes for {count} controls; give one, or one each")
    return amplitude


def _usual_amplitude(text: str, control: str, aircraft: Aircraft, airspeed: float | None) -> float:
    limit = control_limits(aircraft)[control]
    if not math.isfinite(limit):
        raise _error(text, f"amplitude is missing, and {aircraft.name} gives {control} no limit to take a share of")
    size = DEFAULT_SHARE * limit
    if control == THROTTLE:
        size = min(size, _ROOM * _throttle_left(aircraft, airspeed))
    return float(f"{size:.3g}")


def _throttle_left(aircraft: Aircraft, airspeed: float | None) -> float:
    """How far the throttle can be moved both ways from level flight (share of full); 1 where there is none."""
    from sysid_node.dynamics.handbook.equations import Equations  # noqa: PLC0415  # SciPy takes its time
    from sysid_node.dynamics.handbook.trim import level_trim  # noqa: PLC0415

    trim = level_trim(Equations(aircraft), aircraft.reference.airspeed if airspeed is None else airspeed)
    if trim is None or aircraft.throttle is None or aircraft.throttle.max_thrust is None:
        return 1.0
    share = trim.thrust / aircraft.throttle.max_thrust
    return min(share, 1.0 - share) if 0.0 < share < 1.0 else 1.0


def _check(text: str, values: Mapping[str, float]) -> None:
    if values["repeat"] != int(values["repeat"]) or values["repeat"] > 1000:
        raise _error(text, f"repeat is {values['repeat']:g}, expected a whole number, at most 1000")
    if values.get("seed", 0.0) != int(values.get("seed", 0.0)) or values.get("seed", 0.0) > _LARGEST_SEED:
        raise _error(text, f"seed is {values['seed']:g}, expected a whole number, at most {_LARGEST_SEED:g}")
    if "high" in values and values["high"] <= values["low"]:
        raise _error(text, f"high is {values['high']:g} Hz, expected more than low, {values['low']:g} Hz")
