"""How names and numbers are put for a reader: symbols, plain meanings, units, few decimals."""

from __future__ import annotations

import math

from markupsafe import Markup, escape

from sysid_node.aircraft.names import COEFFICIENTS

LONGITUDINAL = ("CL", "CD", "Cm")
LATERAL = ("CY", "Cl", "Cn")

MINUS = "\u2212"
NONE = "\u2013"  # what stands in a cell where there is no number

COEFFICIENT_WORDS = {
    "CL": "lift",
    "CD": "drag",
    "CY": "side force",
    "Cl": "rolling moment",
    "Cm": "pitching moment",
    "Cn": "yawing moment",
}

REGRESSOR_WORDS = {
    "alpha": "angle of attack",
    "beta": "sideslip",
    "p": "roll rate",
    "q": "pitch rate",
    "r": "yaw rate",
    "V": "airspeed",
    "k": "lift squared",
    "de": "elevator",
    "da": "aileron",
    "dr": "rudder",
}

#: What the field calls the derivatives that have a name of their own.
NICKNAMES = {
    "CL_alpha": "lift slope",
    "CD_k": "induced drag",
    "Cm_alpha": "pitch stiffness",
    "Cm_q": "pitch damping",
    "Cm_de": "elevator power",
    "Cl_beta": "dihedral effect",
    "Cl_p": "roll damping",
    "Cl_da": "aileron power",
    "Cn_beta": "weathercock stability",
    "Cn_r": "yaw damping",
    "Cn_da": "adverse yaw",
    "Cn_dr": "rudder power",
}

#: What a status means to who flies: start of the status -> words.
STATUS_WORDS = {
    "not excited": "not moved enough in this flight",
    "collinear": "moved together with another, so they cannot be told apart",
    "converging": "not settled yet: more flying needed",
    "stale input": "a sensor was silent",
    "outside model": "flown where the model does not hold",
    "contradicted": "contradicted by the last seconds",
    "changed": "changed in flight, being learned anew",
}

METHOD_WORDS = {
    "sls_rft": "recursive Fourier transform, sequential least squares",
    "iv_rft": "recursive Fourier transform, instrumental variables",
    "equation_error": "equation error in the time domain",
    "frequency_equation_error": "equation error in the frequency domain",
    "output_error": "output error (maximum likelihood)",
    "filter_error": "filter error (maximum likelihood with process noise)",
}

_C = Markup('<span class="symbol"><i>C</i><sub>{}</sub></span>')
_GREEK = {"alpha": "\u03b1", "beta": "\u03b2"}
_SUPERSCRIPTS = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")


def split_name(name: str) -> tuple[str, str]:
    """``"Cm_alpha"`` to ``("Cm", "alpha")``; any other parameter, say a bias, to ``("", name)``."""
    coefficient, _, regressor = name.partition("_")
    return (coefficient, regressor) if coefficient in COEFFICIENTS and regressor else ("", name)


def symbol(name: str) -> Markup:
    """The derivative or coefficient as it stands in a textbook, in HTML: C with its indices."""
    coefficient, regressor = split_name(name)
    if name in COEFFICIENTS:
        return _C.format(name[1:])
    if not coefficient:
        return escape(name)
    return _C.format(f"{coefficient[1:]}\u202f{_index(regressor)}")


def _index(regressor: str) -> str:
    """A regressor as an index: Greek angles, and a deflection as delta."""
    if len(regressor) == 2 and regressor.startswith("d"):
        return "\u03b4" + regressor[1]
    return _GREEK.get(regressor, regressor)


def meaning(name: str) -> str:
    """In plain words: ``"pitch stiffness: pitching moment due to angle of attack"``."""
    coefficient, regressor = split_name(name)
    if not coefficient:
        return "model parameter"
    force = COEFFICIENT_WORDS[coefficient]
    if regressor == "0":
        return f"{force} offset"
    words = f"{force} due to {REGRESSOR_WORDS.get(regressor, regressor)}"
    return f"{NICKNAMES[name]}: {words}" if name in NICKNAMES else words


def short_meaning(name: str) -> str:
    """The nickname where there is one, else what ``meaning`` says."""
    return NICKNAMES.get(name, meaning(name))


def unit(name: str) -> str:
    """Unit of a derivative: per radian of its regressor, or what that regressor is."""
    coefficient, regressor = split_name(name)
    if not coefficient or regressor == "0":
        return ""
    return {"V": "per V/V\u2080", "k": "per CL\u00b2"}.get(regressor, "per rad")


def status_words(status: str) -> str:
    """A status in a pilot's words; one not known here as it is."""
    return next((words for start, words in STATUS_WORDS.items() if status.startswith(start)), status)


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


def likely(probability: float) -> str:
    """A probability in two decimals, never as certain: ``0.83``, ``over 0.99``, ``under 0.01``."""
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
    """A setting as a person would write it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}".replace("-", MINUS)
    if isinstance(value, list | tuple):
        return " : ".join(setting(part) for part in value)
    return NONE if value is None or value == "" else str(value)


def words_of(key: str) -> str:
    """``"forgetting_time"`` to ``"forgetting time"``."""
    return key.replace("_", " ").strip()


def _power(mantissa: float, decimals: int, exponent: int) -> str:
    text = f"{mantissa:.{decimals}f}".replace("-", MINUS)
    return f"{text}\u202f\u00d7\u202f10{str(exponent).translate(_SUPERSCRIPTS)}"
