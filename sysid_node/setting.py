"""The value of a setting, from the text of ``--set key=value`` or from a plain value."""

from __future__ import annotations

import math
from typing import Any

from sysid_node.errors import InputError

BOOLEANS = {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}

#: Hz: below, no flight is long enough; above, no aircraft moves. And the number of lines that fit into memory.
LOWEST, HIGHEST, MOST_LINES = 1e-4, 1e4, 100_000


def parse_setting(key: str, kind: Any, value: Any) -> Any:
    """The value as a ``kind``: a plain type, or a tuple of frequencies (three numbers) or of names.

    Raises InputError where it cannot be converted.
    """
    numbers = kind == tuple[float, float, float]
    try:
        if numbers:
            start, step, stop = (float(part) for part in (value.split(":") if isinstance(value, str) else value))
            return start, step, stop
        if kind == tuple[str, ...]:
            return tuple(part.strip() for part in value.split(",") if part.strip()) if isinstance(value, str) else value
        if kind is bool and isinstance(value, str):
            return BOOLEANS[value.lower()]
        plain = kind(value)
        if not isinstance(value, str) and (plain != value or isinstance(value, bool) != (kind is bool)):
            raise ValueError  # what int() cuts off, or a truth value that stands where a number is expected
        return plain
    except (KeyError, TypeError, ValueError):
        wanted = "START:STEP:STOP in Hz" if numbers else f"a {kind.__name__}"
        raise InputError(f"setting {key} = {value!r}: expected {wanted}") from None


def check_frequencies(frequencies: tuple[float, float, float]) -> None:
    """Raise InputError unless these are the first frequency, the step and the last frequency, in Hz."""
    start, step, stop = frequencies
    if not (0.0 < start < stop and step > 0.0 and math.isfinite(stop)):
        raise InputError(f"frequencies {start:g}:{step:g}:{stop:g}: expected 0 < start < stop and step > 0, in Hz")
    if start + step > stop * (1.0 + 1e-9):
        raise InputError(f"frequencies {start:g}:{step:g}:{stop:g}: expected two lines or more; narrow the step")
    if start < LOWEST or stop > HIGHEST or (stop - start) / step > MOST_LINES:
        raise InputError(
            f"frequencies {start:g}:{step:g}:{stop:g}: expected {LOWEST:g} to {HIGHEST:g} Hz and"
            f" at most {MOST_LINES} lines"
        )
