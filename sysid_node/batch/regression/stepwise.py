"""Stepwise regression: which regressors the data support.

Klein & Morelli (2006), sec. 5.4. Regressors enter one at a time, the one with the highest partial correlation with
what is still unexplained first; after each, those that have become superfluous leave for good. Three criteria say when
to stop: the partial F-ratio of the next regressor, counted with standard errors for coloured residuals; the predicted
square error (Barron, 1984); the error on stretches of the flights that were left out of the fit.
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

#: F-ratio (squared value over standard error) of a regressor that is worth its place: 1 % by chance.
F_TO_ENTER = 7.0
_FOLDS = 5


@dataclass(frozen=True)
class StepwiseStep:
    """The model after a regressor entered or left: its figures of merit."""

    change: str  # "+alpha" or "-q"
    regressors: tuple[str, ...]
    r_squared: float
    f_ratio: float  # of the regressor that entered or left
    predicted_square_error: float
    cross_validation: float  # mean square error on stretches left out of the fit


@dataclass(frozen=True)
class StepwiseSelection:
    """The regressors chosen, and the way there."""

    regressors: tuple[str, ...]
    steps: tuple[StepwiseStep, ...]


def select_regressors(
    names: Sequence[str],
    ys: Sequence[Array],
    Xs: Sequence[Array],
    always: Sequence[str] = ("0",),
    criterion: str = "f_ratio",
) -> StepwiseSelection:
    """The regressors of ``ys`` (N,) that the columns of ``Xs`` (N, p) named ``names`` earn, flights together.

    Those of ``always`` are in from the start. Raises InputError on an unknown criterion.
    """
    if criterion not in CRITERIA:
        raise InputError(f"criterion {criterion!r}: expected one of {', '.join(CRITERIA)}")
    data = _RegressionData(tuple(names), list(ys), list(Xs))
    chosen = [name for name in names if name in always]
    candidates = [name for name in names if name not in always]
    steps = [data.step("", chosen, np.nan)]
    while candidates:
        best = data.most_correlated(candidates, chosen)
        ratio = data.f_ratio(best, [*chosen, best])
        following = data.step(f"+{best}", [*chosen, best], ratio)
        if not _better(steps[-1], following, criterion):
            break
        candidates.remove(best)
        chosen.append(best)
        steps.append(following)
        for name in [n for n in chosen if n not in always and n != best]:
            ratio = data.f_ratio(name, chosen)
            if ratio < F_TO_ENTER:
                chosen.remove(name)
                steps.append(data.step(f"-{name}", chosen, ratio))
    return StepwiseSelection(tuple(name for name in names if name in chosen), tuple(steps))


def supported_model(
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    low_pass: float = DEFAULT_LOW_PASS,
    criterion: str = "f_ratio",
) -> tuple[Aircraft, dict[str, StepwiseSelection]]:
    """The aircraft with only the derivatives that these flights support, and each coefficient's selection."""
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

    def kept(name: str) -> bool:
        coefficient, regressor = split_derivative(name)
        return coefficient not in selections or regressor in selections[coefficient].regressors

    derivatives = {name: derivative for name, derivative in aircraft.derivatives.items() if kept(name)}
    return replace(aircraft, derivatives=derivatives), selections


def _better(before: StepwiseStep, after: StepwiseStep, criterion: str) -> bool:
    if criterion == "f_ratio":
        return after.f_ratio >= F_TO_ENTER
    return bool(getattr(after, criterion) < getattr(before, criterion))


class _RegressionData:
    """Both sides of an equation, with what stepwise regression asks of them."""

    def __init__(self, names: tuple[str, ...], ys: list[Array], Xs: list[Array]) -> None:
        self.names, self.ys, self.Xs = names, ys, Xs
        self.y, self.X = np.concatenate(ys), np.concatenate(Xs)
        self.variance = float(np.var(self.y))

    def _columns(self, chosen: Sequence[str]) -> list[int]:
        return [self.names.index(name) for name in chosen]

    def _residual(self, target: Array, chosen: Sequence[str]) -> Array:
        X = self.X[:, self._columns(chosen)]
        return np.asarray(target - X @ np.linalg.lstsq(X, target, rcond=None)[0]) if chosen else target

    def most_correlated(self, others: Sequence[str], chosen: Sequence[str]) -> str:
        """The one of ``others`` whose part that is new has the highest correlation with what is unexplained."""
        rest = self._residual(self.y, chosen)
        new = self._residual(self.X[:, self._columns(others)], chosen)
        size = np.linalg.norm(new, axis=0)
        # what is left of a regressor that the others make up is rounding error
        real = size > 1e-9 * np.linalg.norm(self.X[:, self._columns(others)], axis=0)
        score = np.where(real, np.abs(new.T @ rest) / np.where(real, size, 1.0), -1.0)
        return others[int(np.argmax(score))]

    def f_ratio(self, name: str, chosen: Sequence[str]) -> float:
        """(value / standard error)^2 of one regressor, the standard error for coloured residuals."""
        index = self._columns(chosen)
        estimate = regress(chosen, self.ys, [X[:, index] for X in self.Xs]).estimates[name]
        return (estimate.value / estimate.standard_error) ** 2 if estimate.valid else 0.0

    def step(self, change: str, chosen: Sequence[str], ratio: float) -> StepwiseStep:
        error = float(np.mean(self._residual(self.y, chosen) ** 2))
        penalty = self.variance * len(chosen) / len(self.y)
        explained = 1.0 - error / self.variance if self.variance > 0.0 else np.nan
        return StepwiseStep(change, tuple(chosen), explained, ratio, error + penalty, self._cross_validated(chosen))

    def _cross_validated(self, chosen: Sequence[str]) -> float:
        """Mean square error on each fifth of the data in turn, the rest being fitted."""
        X = self.X[:, self._columns(chosen)]
        squares = 0.0
        for fold in np.array_split(np.arange(len(self.y)), _FOLDS):
            kept = np.ones(len(self.y), bool)
            kept[fold] = False
            values = np.linalg.lstsq(X[kept], self.y[kept], rcond=None)[0]
            squares += float(np.sum((self.y[fold] - X[fold] @ values) ** 2))
        return squares / len(self.y)
