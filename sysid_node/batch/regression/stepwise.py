"""Stepwise regression: the regressors of each coefficient that the data support.

Klein & Morelli, "Aircraft System Identification" (2006), sec. 5.4. Regressors enter one at a time, the one with the
highest partial correlation with the residual first. After each step, those that have become superfluous leave for good.
One of three criteria stops the selection: the partial F-ratio of the next regressor, with standard errors for coloured
residuals; the predicted square error (Barron, 1984); or the error on parts of the flights left out of the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import split_derivative
from sysid_node.batch.regression.filtering import lowpass
from sysid_node.batch.regression.linear_regression import regress
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient
from sysid_node.batch.settings import DEFAULT_LOW_PASS
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

CRITERIA = ("f_ratio", "predicted_square_error", "cross_validation")

#: Smallest partial F-ratio (squared value over standard error) of a regressor that enters: 1 % by chance.
F_TO_ENTER = 7.0
_FOLDS = 5


@dataclass(frozen=True)
class StepwiseStep:
    """The figures of merit of the model after a regressor entered or left."""

    change: str  # "+alpha" or "-q"
    regressors: tuple[str, ...]
    r_squared: float
    f_ratio: float  # of the regressor that entered or left
    predicted_square_error: float
    cross_validation: float  # mean square error on the parts left out of the fit


@dataclass(frozen=True)
class StepwiseSelection:
    """The selected regressors, and the steps that led to them."""

    regressors: tuple[str, ...]
    steps: tuple[StepwiseStep, ...]


def select_regressors(
    names: Sequence[str],
    ys: Sequence[Array],
    Xs: Sequence[Array],
    always: Sequence[str] = ("0",),
    criterion: str = "f_ratio",
) -> StepwiseSelection:
    """The selected regressors of ``ys`` (N,) among the columns ``names`` of ``Xs`` (N, p), all flights together.

    Those of ``always`` are in the model from the start. Raises InputError on an unknown criterion.
    """
    if criterion not in CRITERIA:
        raise InputError(f"criterion {criterion!r}: expected one of {', '.join(CRITERIA)}")
    equation = _Equation(tuple(names), list(ys), list(Xs))
    selected = [name for name in names if name in always]
    candidates = [name for name in names if name not in always]
    steps = [equation.step_with("", selected, np.nan)]
    while candidates:
        best = equation.most_correlated(candidates, selected)
        ratio = equation.f_ratio(best, [*selected, best])
        following = equation.step_with(f"+{best}", [*selected, best], ratio)
        if not _better(steps[-1], following, criterion):
            break
        candidates.remove(best)
        selected.append(best)
        steps.append(following)
        for name in [n for n in selected if n not in always and n != best]:
            ratio = equation.f_ratio(name, selected)
            if ratio < F_TO_ENTER:
                selected.remove(name)
                steps.append(equation.step_with(f"-{name}", selected, ratio))
    return StepwiseSelection(tuple(name for name in names if name in selected), tuple(steps))


def supported_model(
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    low_pass: float = DEFAULT_LOW_PASS,
    criterion: str = "f_ratio",
) -> tuple[Aircraft, dict[str, StepwiseSelection]]:
    """The aircraft with the derivatives that these flights support, and the selection of each coefficient."""
    flights = [measured_coefficients(aircraft, record) for record in records]
    selections = {
        coefficient: select_regressors(
            regressors,
            [lowpass(flight.time, flight.coefficients[coefficient], low_pass) for flight in flights],
            [lowpass(flight.time, regressor_matrix(flight, regressors), low_pass) for flight in flights],
            criterion=criterion,
        )
        for coefficient, regressors in regressors_by_coefficient(aircraft, flights).items()
    }

    def supported(name: str) -> bool:
        coefficient, regressor = split_derivative(name)
        return coefficient not in selections or regressor in selections[coefficient].regressors

    derivatives = {name: derivative for name, derivative in aircraft.derivatives.items() if supported(name)}
    return replace(aircraft, derivatives=derivatives), selections


def _better(before: StepwiseStep, after: StepwiseStep, criterion: str) -> bool:
    if criterion == "f_ratio":
        return after.f_ratio >= F_TO_ENTER
    return bool(getattr(after, criterion) < getattr(before, criterion))


class _Equation:
    """Both sides of a regression equation, and the figures of merit of models with some of its regressors."""

    def __init__(self, names: tuple[str, ...], ys: list[Array], Xs: list[Array]) -> None:
        self.names, self.ys, self.Xs = names, ys, Xs
        self.y, self.X = np.concatenate(ys), np.concatenate(Xs)
        self.variance = float(np.var(self.y))

    def _columns(self, selected: Sequence[str]) -> list[int]:
        return [self.names.index(name) for name in selected]

    def _residual(self, target: Array, selected: Sequence[str]) -> Array:
        X = self.X[:, self._columns(selected)]
        return np.asarray(target - X @ np.linalg.lstsq(X, target, rcond=None)[0]) if selected else target

    def most_correlated(self, others: Sequence[str], selected: Sequence[str]) -> str:
        """The regressor of ``others`` with the highest partial correlation with the residual, given ``selected``."""
        residual = self._residual(self.y, selected)
        orthogonal = self._residual(self.X[:, self._columns(others)], selected)
        norm = np.linalg.norm(orthogonal, axis=0)
        # a regressor that is a combination of the others leaves only rounding errors
        independent = norm > 1e-9 * np.linalg.norm(self.X[:, self._columns(others)], axis=0)
        score = np.where(independent, np.abs(orthogonal.T @ residual) / np.where(independent, norm, 1.0), -1.0)
        return others[int(np.argmax(score))]

    def f_ratio(self, name: str, selected: Sequence[str]) -> float:
        """(value / standard error)^2 of one regressor, the standard error for coloured residuals."""
        index = self._columns(selected)
        estimate = regress(selected, self.ys, [X[:, index] for X in self.Xs]).estimates[name]
        return (estimate.value / estimate.standard_error) ** 2 if estimate.valid else 0.0

    def step_with(self, change: str, selected: Sequence[str], ratio: float) -> StepwiseStep:
        error = float(np.mean(self._residual(self.y, selected) ** 2))
        penalty = self.variance * len(selected) / len(self.y)
        explained = 1.0 - error / self.variance if self.variance > 0.0 else np.nan
        return StepwiseStep(change, tuple(selected), explained, ratio, error + penalty, self._cross_validated(selected))

    def _cross_validated(self, selected: Sequence[str]) -> float:
        """Mean square error on each fifth of the data in turn, the rest being fitted."""
        X = self.X[:, self._columns(selected)]
        squares = 0.0
        for fold in np.array_split(np.arange(len(self.y)), _FOLDS):
            fitted = np.ones(len(self.y), bool)
            fitted[fold] = False
            values = np.linalg.lstsq(X[fitted], self.y[fitted], rcond=None)[0]
            squares += float(np.sum((self.y[fold] - X[fold] @ values) ** 2))
        return squares / len(self.y)
