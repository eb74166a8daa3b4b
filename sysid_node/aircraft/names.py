"""Names of coefficients, regressors and derivatives.

A derivative is called ``<coefficient>_<regressor>``: ``Cm_alpha``, ``CL_0``, ``Cn_dr``.
Symbols follow Klein & Morelli, "Aircraft System Identification" (2006), ch. 3.
"""

from __future__ import annotations

from collections.abc import Iterable

#: Non-dimensional coefficients. CL, CD in stability axes; CY, Cl, Cm, Cn in body axes.
COEFFICIENTS = ("CL", "CD", "CY", "Cl", "Cm", "Cn")

#: Coefficients of motion in the plane of symmetry, and out of it.
LONGITUDINAL = ("CL", "CD", "Cm")
LATERAL = ("CY", "Cl", "Cn")

#: Signals of motion in the plane of symmetry: those that a flight without lateral measurements has.
LONGITUDINAL_SIGNALS = ("V", "alpha", "theta", "q", "ax", "az")

#: Signals of motion out of it.
LATERAL_SIGNALS = ("beta", "phi", "psi", "p", "r", "ay")

#: Regressors that every aircraft has, and their meaning. The symbols of its controls are regressors, too.
STATE_REGRESSORS = {
    "0": "offset, 1",
    "alpha": "angle of attack, rad",
    "beta": "sideslip, rad",
    "p": "roll rate, p b / 2V",
    "q": "pitch rate, q cbar / 2V",
    "r": "yaw rate, r b / 2V",
    "V": "airspeed over reference airspeed, V / V0",
    "k": "lift coefficient squared, CL^2 (drag only)",
}

#: Symbols of the standard controls; a further control states its own in the aircraft file.
CONTROL_SYMBOLS = {"elevator": "de", "aileron": "da", "rudder": "dr"}

#: Names of signals, which a control's symbol must not have.
RESERVED_SYMBOLS = frozenset(STATE_REGRESSORS) | {"ax", "ay", "az", "phi", "theta", "psi", "rho", "thrust", "time", "t"}

#: The derivatives of the full linear model, in the order of tables.
STANDARD_DERIVATIVES = (
    *("CL_0", "CL_alpha", "CL_q", "CL_de"),
    *("CD_0", "CD_alpha", "CD_q", "CD_de"),
    *("Cm_0", "Cm_alpha", "Cm_q", "Cm_de"),
    *("CY_beta", "CY_p", "CY_r", "CY_da", "CY_dr"),
    *("Cl_beta", "Cl_p", "Cl_r", "Cl_da", "Cl_dr"),
    *("Cn_beta", "Cn_p", "Cn_r", "Cn_da", "Cn_dr"),
)


def split_derivative(name: str) -> tuple[str, str]:
    """Coefficient and regressor: ``("Cm", "alpha")`` of ``"Cm_alpha"``. Raises ValueError for any other form."""
    coefficient, _, regressor = name.partition("_")
    if coefficient not in COEFFICIENTS or not regressor:
        raise ValueError(
            f"derivative {name!r}: expected <coefficient>_<regressor> with a coefficient of "
            f"{', '.join(COEFFICIENTS)}, e.g. Cm_alpha"
        )
    return coefficient, regressor


def model_structure(derivatives: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Regressors of each coefficient, in the order given; a coefficient without any is left out."""
    structure: dict[str, list[str]] = {}
    for name in derivatives:
        coefficient, regressor = split_derivative(name)
        structure.setdefault(coefficient, []).append(regressor)
    return {c: tuple(structure[c]) for c in COEFFICIENTS if c in structure}
