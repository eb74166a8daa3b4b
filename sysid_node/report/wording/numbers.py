"""How a report writes numbers, times, lists and settings."""

from __future__ import annotations

import math

from markupsafe import Markup, escape

MINUS = "\u2212"

NONE = "\u2013"  # what stands in a cell where there is no number

_SUPERSCRIPTS = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")


def plural(count: int, word: str) -> str:
    """``"1 flight"``, ``"2 flights"``."""
    return f"{count} {word}" + ("" if count == 1 else "s")


def listing(words: list[Markup] | list[str], most: int = 4) -> Markup:
    """``a, b and c``; beyond ``most`` entries the rest is counted."""
    if len(words) > most:
        words = [*words[: most - 1], f"{len(words) - most + 1} others"]
    if len(words) < 2:
        return escape(words[0]) if words else Markup("")
    return Markup("{} and {}").format(Markup(", ").join(words[:-1]), words[-1])


def number(value: float, digits: int = 3) -> str:
    """A number with so many significant digits; large and small ones as a power of ten."""
    if not math.isfinite(value):
        return NONE if math.isnan(value) else (MINUS if value < 0 else "") + "\u221e"
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if -4 < exponent < 6:
        return f"{value:.{max(digits - 1 - exponent, 0)}f}".replace("-", MINUS)
    return _power(value / 10.0**exponent, digits - 1, exponent)


def percentage(value: float) -> str:
    """So many per cent, without the sign: three significant digits, and no more than one decimal."""
    return number(round(value, 1), 3)


def likely(probability: float) -> str:
    """A probability in two decimals, never as 0 or 1: ``0.83``, ``over 0.99``, ``under 0.01``."""
    if probability >= 0.995:
        return "over 0.99"
    return f"{probability:.2f}" if probability >= 0.005 else "under 0.01"


def with_interval(value: float, half_width: float) -> str:
    """``value \u00b1 half width``, the half width with two significant digits; NONE where there is no value."""
    if not math.isfinite(value):
        return NONE
    if not math.isfinite(half_width):
        return number(value)
    if half_width <= 0:
        return f"{number(value)} \u00b1 0"
    exponent = math.floor(math.log10(float(f"{half_width:.1e}")))
    largest = math.floor(math.log10(max(abs(value), half_width)))
    if exponent >= -5 and largest < 6:
        decimals = max(1 - exponent, 0)
        return f"{value:z.{decimals}f} \u00b1 {half_width:.{decimals}f}".replace("-", MINUS)
    scale, decimals = 10.0**largest, max(largest - exponent + 1, 0)
    pair = f"({value / scale:z.{decimals}f} \u00b1 {half_width / scale:.{decimals}f})".replace("-", MINUS)
    return f"{pair}\u202f\u00d7\u202f10{str(largest).translate(_SUPERSCRIPTS)}"


def seconds(value: float) -> str:
    """``"60 s"``, ``"12 min 30 s"``."""
    if not math.isfinite(value):
        return NONE
    if value < 300:
        return f"{value:.4g}\u202fs"
    minutes, rest = divmod(round(value), 60)
    return f"{minutes}\u202fmin {rest}\u202fs"


def setting(value: object) -> str:
    """The text of a setting's value."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}".replace("-", MINUS)
    if isinstance(value, list | tuple):
        return " : ".join(setting(part) for part in value)
    return NONE if value is None or value == "" else str(value)


def _power(mantissa: float, decimals: int, exponent: int) -> str:
    text = f"{mantissa:.{decimals}f}".replace("-", MINUS)
    return f"{text}\u202f\u00d7\u202f10{str(exponent).translate(_SUPERSCRIPTS)}"
