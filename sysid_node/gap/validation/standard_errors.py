"""Standard errors of the sizes that allow for a remainder that is no noise, and for a model that is not exact.

If the remainder were noise with its own spectrum, the inverse of the information would be the covariance. What the
model lacks repeats itself from window to window instead. So the change that each group of windows alone would make is
computed, and its scatter from group to group is taken where that is more (White (1982), Econometrica 50(1); by
clusters: Liang & Zeger (1986), Biometrika 73(1)).

What an aircraft has beside the effects of the list may change a size in the same way in every window, which no scatter
shows. A size is therefore also uncertain by a share of itself, which ``bench/gap/size_errors.py`` learned from aircraft
that are not the simulator's (a discrepancy of the model: Kennedy & O'Hagan (2001), J. R. Stat. Soc. B 63(3)).
"""

from __future__ import annotations

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, onset_places
from sysid_node.gap.estimation.predictive_density import window_groups
from sysid_node.gap.instruments.liml import influence
from sysid_node.gap.selection.onset import onset_uncertainty
from sysid_node.gap.thresholds import THRESHOLDS


def with_standard_error(name: str, value: float, error: float) -> list[float]:
    """A parameter's value, and its standard error by chance (``error``) and by the model together.

    An onset is a time and no size: its standard error is that by chance.
    """
    return [value, error if name == "onset" else float(np.hypot(error, THRESHOLDS.validation.discrepancy * value))]


def standard_errors(fit: CandidateFit) -> Array:
    """Standard errors (unknowns,) by chance alone, of a fit of ``instruments.liml.liml_estimate``."""
    errors = scattered_errors(fit)
    for place in onset_places(fit):
        errors[place] = onset_uncertainty(fit, place)
    return errors


def scattered_errors(fit: CandidateFit) -> Array:
    """Standard errors (unknowns,) by chance alone of all but onsets."""
    steps = np.array([part[group].sum(axis=0) for model, part in zip(fit.models, influence(fit), strict=True)
                      for group in window_groups(model)])  # fmt: skip
    steps = steps - steps.mean(axis=0)
    scatter = (steps**2).sum(axis=0) * len(steps) / max(len(steps) - 1, 1)
    return np.asarray(np.sqrt(np.maximum(np.diag(fit.covariance), scatter)))
