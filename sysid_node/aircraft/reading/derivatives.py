"""The block ``derivatives`` of an aircraft file."""

from __future__ import annotations

from collections.abc import Mapping

from sysid_node.aircraft.document import DocumentEntry
from sysid_node.aircraft.model import Control, Derivative
from sysid_node.aircraft.names import COEFFICIENTS, STATE_REGRESSORS, split_derivative
from sysid_node.suggestion import did_you_mean


def read_derivatives(entry: DocumentEntry, controls: Mapping[str, Control]) -> dict[str, Derivative]:
    """The derivatives by name. Raises InputError."""
    entries = entry.mapping("a mapping from derivative to {value: , tolerance: }")
    if not entries:
        raise entry.error("no derivative given; expected e.g. Cm_alpha: {value: -0.5}")
    symbols = {control.symbol for control in controls.values()}
    for name, item in entries.items():
        _check_derivative_name(name, item, symbols)
    if "CD_k" in entries and "CD_alpha" in entries:
        raise entries["CD_k"].error("stands in place of CD_alpha, which is given too; keep one")
    return {name: _derivative(item) for name, item in entries.items()}


def _check_derivative_name(name: str, entry: DocumentEntry, symbols: set[str]) -> None:
    regressors = [*STATE_REGRESSORS, *sorted(symbols)]
    try:
        coefficient, regressor = split_derivative(name)
    except ValueError as error:
        known = [f"{c}_{r}" for c in COEFFICIENTS for r in regressors]
        raise entry.error(f"{error}{did_you_mean(name, known)}") from error
    if regressor not in regressors:
        raise entry.error(f"{regressor!r} is none of {', '.join(regressors)}; a further control must be in controls")
    if regressor == "k" and coefficient != "CD":
        raise entry.error("the regressor k (CL^2) is for CD only")


#: The smallest tolerance of a derivative: its inverse square is the weight of the stated value.
_SMALLEST = 1e-9


def _derivative(entry: DocumentEntry) -> Derivative:
    fields = entry.fields({"value": "the derivative, per radian"}, optional=("tolerance",))
    value = fields["value"].number("a number (per rad)")
    if "tolerance" not in fields:
        return Derivative(value)
    expected = f"at least {_SMALLEST:g}, 1 sigma in the derivative's unit (leave it out where it is not known)"
    return Derivative(value, fields["tolerance"].number(expected, lambda x: x >= _SMALLEST))
