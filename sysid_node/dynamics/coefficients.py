"""The aircraft file's aerodynamic model: coefficients that are linear in the derivatives, and their regressors.

Regressors are those of ``aircraft.names``; rates are made non-dimensional by ``b / 2V`` and ``cbar / 2V``: Klein &
Morelli (2006), "Aircraft System Identification", ch. 3.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from sysid_node.dynamics.airflow import Flow
from sysid_node.dynamics.vector import Real, Triple


class Coefficients(NamedTuple):
    """CL, CD in stability axes, CY and the moments Cl, Cm, Cn in body axes; the order of ``names.COEFFICIENTS``."""

    CL: Real
    CD: Real
    CY: Real
    Cl: Real
    Cm: Real
    Cn: Real


def rate_regressors(rates: Triple, half: Real, span: Real, chord: Real) -> Triple:
    """Non-dimensional rates p b / 2V, q cbar / 2V, r b / 2V of rates (rad/s); ``half`` is 1 / 2V (s/m)."""
    p, q, r = rates
    return p * span * half, q * chord * half, r * span * half


def regressors(
    flow: Flow, rates: Triple, span: Real, chord: Real, reference_airspeed: Real, one: Real = 1.0
) -> dict[str, Real]:
    """Every regressor of the state by name, but for CL^2: 0, alpha, beta, p, q, r, V.

    ``flow`` airspeed (m/s), alpha and beta (rad); ``rates`` rad/s relative to the air; ``span`` and ``chord`` m. The
    offset's regressor is ``one``, of the shape of the others.
    """
    airspeed, alpha, beta = flow
    p, q, r = rate_regressors(rates, 0.5 / airspeed, span, chord)
    return {"0": one, "alpha": alpha, "beta": beta, "p": p, "q": q, "r": r, "V": airspeed / reference_airspeed}


def linear_coefficient(terms: Iterable[tuple[Real, str]], regressors: Mapping[str, Real], zero: Real = 0.0) -> Real:
    """C = sum of derivative times regressor over terms (derivative, regressor's name); ``zero`` has its shape."""
    return sum((derivative * regressors[name] for derivative, name in terms), zero)


def with_polar(regressors: Mapping[str, Real], lift: Real) -> dict[str, Real]:
    """The regressors with that of the drag polar CD = CD_0 + CD_k CL^2; ``lift`` is CL."""
    return {**regressors, "k": lift * lift}
