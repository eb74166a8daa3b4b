"""The words of a report for derivatives, coefficients, statuses and methods: symbols, plain meanings, units."""

from __future__ import annotations

from markupsafe import Markup, escape

from sysid_node.aircraft.names import COEFFICIENTS

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

#: Common names of derivatives.
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

#: What a status means: start of the status -> words for a pilot.
STATUS_WORDS = {
    "not excited": "not excited enough in this flight",
    "collinear": "collinear with another, so that the two cannot be distinguished",
    "converging": "not settled yet; more flying is needed",
    "stale input": "a sensor sent no data",
    "outside model": "flown where the model does not hold",
    "contradicted: the online": "contradicted by the online estimator",
    "contradicted": "contradicted by the last seconds of the flight",
    "unconfirmed": "biased by gusts or a model error, and not known to the online estimator",
    "changed": "changed in flight and being estimated anew",
}

METHOD_WORDS = {
    "sls_rft": "recursive Fourier transform, sequential least squares",
    "iv_rft": "recursive Fourier transform, instrumental variables",
    "equation_error": "equation error in the time domain",
    "frequency_equation_error": "equation error in the frequency domain",
    "output_error": "output error (maximum likelihood)",
    "filter_error": "filter error (maximum likelihood with process noise)",
    "recursive_least_squares": "recursive least squares",
    "error_filtering": "recursive least squares with error filtering",
    "constrained_least_squares": "recursive least squares with constraints",
    "neural_gauss_newton": "neural Gauss-Newton",
}

_C = Markup('<span class="symbol"><i>C</i><sub>{}</sub></span>')

_GREEK = {"alpha": "\u03b1", "beta": "\u03b2"}


def split_name(name: str) -> tuple[str, str]:
    """``"Cm_alpha"`` to ``("Cm", "alpha")``; any other parameter, say a bias, to ``("", name)``."""
    coefficient, _, regressor = name.partition("_")
    return (coefficient, regressor) if coefficient in COEFFICIENTS and regressor else ("", name)


def symbol(name: str) -> Markup:
    """The symbol of a derivative or coefficient in HTML: C with its indices."""
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
    """The common name where there is one, else the result of ``meaning``."""
    return NICKNAMES.get(name, meaning(name))


def unit(name: str) -> str:
    """The unit of a derivative: per unit of its regressor; "" for an offset."""
    coefficient, regressor = split_name(name)
    if not coefficient or regressor == "0":
        return ""
    return {"V": "per V/V\u2080", "k": "per CL\u00b2"}.get(regressor, "per rad")


def status_words(status: str) -> str:
    """A status in words for a pilot; an unknown status is returned as it is."""
    control, late, _ = status.partition(" not on time")
    if late:
        return f"how late the {REGRESSOR_WORDS.get(control, control)} follows is not known well enough"
    return next((words for start, words in STATUS_WORDS.items() if status.startswith(start)), status)


def words_of(key: str) -> str:
    """``"forgetting_time"`` to ``"forgetting time"``."""
    return key.replace("_", " ").strip()
