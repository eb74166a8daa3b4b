"""Whether an explanation stands on flight that was not fitted, as pure functions of errors.

Errors (rms, as shares of the motion) are those of the aircraft file (``before``), of the derivatives fitted within
their tolerances (``tolerances``) and with the causes (``after``), by one or two measures: forces and kinematics by
frequency, then short simulated flights where these can be simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds


class Errors(Protocol):
    """Errors by one measure."""

    @property
    def before(self) -> float:
        """Of the aircraft file."""

    @property
    def tolerances(self) -> float:
        """Of the derivatives fitted within their tolerances."""

    @property
    def after(self) -> float:
        """With the causes."""


class ErrorTable(NamedTuple):
    """Errors by one measure as plain values."""

    before: float
    tolerances: float
    after: float


def causes_stand(errors: Sequence[Errors]) -> bool:
    """Whether causes predict better than the derivatives by at least one measure, and than the file by every one."""
    return any(e.after < e.tolerances for e in errors) and all(e.after < e.before for e in errors)


def file_predicts_better(errors: Sequence[Errors]) -> bool:
    """Whether the file predicts better than the fitted derivatives, by at least one measure.

    In gusts derivatives that these have biased may predict better by frequency.
    """
    return any(e.tolerances > e.before for e in errors)


def file_derivatives_suit_causes(with_file: Sequence[Errors], with_fitted: Sequence[Errors]) -> bool:
    """Whether causes predict better with the file's derivatives than with the fitted ones, by the last measure."""
    return with_file[-1].after < with_fitted[-1].after


def weather_accounts_for(before: Array, floors: Array, thresholds: Thresholds = THRESHOLDS) -> bool:
    """Whether weather and the sensors' noise account for the file's error in every reading.

    ``before`` (R,) are mean squares of the file's errors, ``floors`` (K, R) those that K simulated flights with nothing
    wrong leave in such air.
    """
    return bool((before <= thresholds.validation.chance**2 * np.mean(floors, axis=0)).all())
