"""Plausibility of a flight given as columns: units, spelling, and values that no aircraft measures.

The limits are those of messages in ``checks``. A single sample beyond them is left out and counted, as a message is;
where a unit must be wrong the flight is refused. Angles and rates in degrees that stay within the limits show where the
attitude and the rates are compared with each other.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight import checks
from sysid_node.flight.record import COLUMNS, Array

COLUMN_LIMIT = 1000
#: Share of samples beyond a limit from which on the unit must be wrong, not the sample.
WRONG_UNIT = 0.02
SLOWEST, FASTEST = 1.0, 1e-5  # s from sample to sample

_MOST_NAMED = 4  # columns that a warning names

LONGEST_GAP = 3600.0  # s; beyond it, it is another flight, or the clock was set

_MOTION = ("ax", "ay", "az", "p", "q", "r")
_EXPECTED = (*_MOTION, "V", "alpha", "beta")
#: A ratio between 57.3 / 3 and 57.3 * 3 is taken for degrees; that of sound data is near 1.
_DEGREES = (math.degrees(1.0) / 3.0, math.degrees(1.0) * 3.0)
_SPAN, _CORRELATED = 1.0, 0.7  # s; least correlation at which a ratio counts
#: What the columns are called elsewhere.
_OTHER_WORDS = {
    "V": ("tas", "va", "airspeed", "true_airspeed"),
    "alpha": ("aoa", "alfa", "angle_of_attack"),
    "beta": ("aos", "ssa", "sideslip", "angle_of_sideslip"),
    "phi": ("roll", "bank"),
    "theta": ("pitch",),
    "psi": ("yaw", "heading"),
    "rho": ("density", "air_density"),
    "de": ("elevator", "elev"),
    "da": ("aileron", "ail"),
    "dr": ("rudder", "rud"),
}

_ANGLES = {
    "phi": (1.01 * math.pi, "phi over pi rad (degrees?)"),
    "theta": (1.01 * math.pi / 2.0, "theta over pi/2 rad (degrees?)"),
    "psi": (1.0e4, "psi over 10000 rad"),
    "de": (checks.ANGLE_LIMIT, "de over pi/2 rad (degrees?)"),
    "da": (checks.ANGLE_LIMIT, "da over pi/2 rad (degrees?)"),
    "dr": (checks.ANGLE_LIMIT, "dr over pi/2 rad (degrees?)"),
}


def check_names(names: Sequence[str], time: str, controls: Collection[str] | None = None) -> None:
    """Raise InputError where the columns' names cannot be those of a flight; warn of missing and of unused ones.

    The warning gives the column that is likely meant by another name. ``controls``: symbols of the aircraft's controls;
    None where any column may be one.
    """
    if len(names) == 1 and (";" in names[0] or "\t" in names[0]):
        raise InputError("cells are not separated by commas; write it with commas, and a point in numbers")
    if len(names) > COLUMN_LIMIT:
        raise InputError(f"{len(names)} columns, over {COLUMN_LIMIT}; leave out what is not of the flight")
    if time not in names:
        raise InputError(f"no column {time!r} (time in s); the first line must name the columns")
    twice = sorted(name for name, count in Counter(names).items() if count > 1)
    if twice:
        raise InputError(f"column {twice[0]!r} is there twice; leave one out")
    others = [name for name in names if name not in COLUMNS and name != time]
    missing, meant = [], set()
    for column in (name for name in COLUMNS if name not in names):
        alike = likely_name(column, others)
        if alike:
            meant.add(alike)
            taken = "taken for a further control" if controls is None or alike in controls else "not used"
            _warn(f"no column {column!r}, but {alike!r}, which is {taken}; is it {column!r}?")
        elif column in _EXPECTED:
            missing.append(column)
    if missing:
        _warn(f"no column {', '.join(map(repr, missing))}: taken as not measured")
    unused = [name for name in others if controls is not None and name not in controls and name not in meant]
    if unused:
        more = f" and {len(unused) - _MOST_NAMED} more" if len(unused) > _MOST_NAMED else ""
        named = ", ".join(map(repr, unused[:_MOST_NAMED]))
        _warn(f"not used: column {named}{more}; rename it if it is a signal of the flight or a control of the aircraft")


def check_time(time: Array) -> None:
    """Raise InputError where the time cannot be in s."""
    step = float(np.median(np.diff(time)))
    if not FASTEST <= step <= SLOWEST:
        unit = next((f" ({name}?)" for name, size in (("ns", 1e6), ("us", 1e3), ("ms", 1.0)) if step > size), "")
        raise InputError(f"time steps by {step:g} from sample to sample{unit}; expected seconds, {FASTEST:g} to 1 s")

    gap = int(np.argmax(np.diff(time)))
    if time[gap + 1] - time[gap] > LONGEST_GAP:
        raise InputError(f"time jumps by {time[gap + 1] - time[gap]:g} s at {time[gap]:g} s; make two flights of it")


def implausible(time: Array, columns: Mapping[str, Array]) -> NDArray[np.object_]:
    """For each sample (N,) why it is left out, or None.

    Raises InputError where so many samples are beyond a limit that the unit must be wrong, or where attitude and rates
    are in different units.
    """
    faults = np.full(time.shape, None, object)
    for name, (limit, reason) in reversed(_ANGLES.items()):
        if name in columns:
            faults[np.abs(columns[name]) > limit] = reason
    rho, thrust = (columns.get(name, np.full(time.shape, np.nan)) for name in ("rho", "thrust"))
    faults[np.abs(thrust) > checks.THRUST_LIMIT] = checks.THRUST
    _put(faults, checks.air_data_faults(_filled(columns, time, {"V": 10.0, "alpha": 0.0, "beta": 0.0}, rho)))
    _put(faults, checks.imu_faults(_filled(columns, time, dict.fromkeys(_MOTION, 0.0))))
    units = Counter(faults[faults != None].tolist())  # noqa: E711  # each element is compared
    if "V" in columns:
        units[checks.AIRSPEED] = int(np.count_nonzero(columns["V"] >= checks.AIRSPEED_HIGH))  # low on the ground
    for reason, count in units.items():
        if count > WRONG_UNIT * time.size:
            raise InputError(f"{count} of {time.size} samples: {reason}; expected SI units and radians")
    _compare_attitude_with_rates(time, columns)
    return faults


def _compare_attitude_with_rates(time: Array, columns: Mapping[str, Array]) -> None:
    """Raise InputError where an angle changes 57 times as much as its rate says, or as little."""
    for angle, rate in (("phi", "p"), ("theta", "q"), ("psi", "r")):
        ratio = _ratio(time, columns.get(angle), columns.get(rate))
        if ratio is None:
            continue
        low, high = _DEGREES
        if low < ratio < high:
            raise InputError(f"{angle} changes {ratio:.0f} times as much as {rate} says; is {angle} in degrees?")
        if ratio * low < 1.0 < ratio * high:
            raise InputError(f"{angle} changes {1 / ratio:.0f} times less than {rate} says; is {rate} in deg/s?")


def _ratio(time: Array, angle: Array | None, rate: Array | None) -> float | None:
    """How many times as much an angle changes within a second as its rate says; None where nothing can be said."""
    if angle is None or rate is None:
        return None
    good = np.isfinite(angle) & np.isfinite(rate)
    if np.count_nonzero(good) < 10:
        return None
    t, angle, rate = time[good], angle[good], rate[good]
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
    later = np.searchsorted(t, t + _SPAN)
    later, begin = later[later < t.size], np.flatnonzero(later < t.size)
    near = t[later] - t[begin] < 1.5 * _SPAN
    x, y = (values[later[near]] - values[begin[near]] for values in (turned, angle))
    full = 2.0 * math.pi if np.abs(angle).max() < 7.0 else 360.0
    near = np.abs(y) < full / 2.0  # a heading that passes north
    x, y = x[near], y[near]
    scale = float(np.sqrt((x @ x) * (y @ y))) if x.size > 10 else 0.0
    if not (0.0 < scale < math.inf and float(x @ y) >= _CORRELATED * scale and float(x @ x)):
        return None
    return float(x @ y) / float(x @ x)


def _filled(columns: Mapping[str, Array], time: Array, plausible: Mapping[str, float], *more: Array) -> Array:
    """Columns side by side; what was not measured is given a plausible value."""
    given = [np.nan_to_num(columns.get(n, np.full(time.shape, np.nan)), nan=value) for n, value in plausible.items()]
    return np.column_stack([*given, *more])


def _put(faults: NDArray[np.object_], others: NDArray[np.object_]) -> None:
    found = np.array([other is not None for other in others], bool)
    faults[found] = others[found]


def likely_name(column: str, others: Sequence[str]) -> str | None:
    """The name among ``others`` by which the column is likely meant: another word for it, or a misspelling."""
    folded = {name.casefold().strip("_ "): name for name in others}
    for word in (column.casefold(), *_OTHER_WORDS.get(column, ())):
        if word in folded:
            return folded[word]
    if len(column) < 3:
        return None
    found = get_close_matches(column.casefold(), list(folded), n=1, cutoff=0.75)
    return folded[found[0]] if found else None


def _warn(text: str) -> None:
    warnings.warn(text, InputWarning, stacklevel=3)
