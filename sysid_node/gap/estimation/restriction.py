"""Fits with some unknowns held at the aircraft file's values, because the flight does not show that they differ.

A cause has all the parameters of its effect: a shift of the centre of gravity along three axes, six scales of an IMU.
Mostly one of them is really off. The others are fitted to what no model describes, and another flight is then predicted
worse. The same holds for derivatives beside a cause.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised, stepped

#: Standard errors within which a size is insignificant: those of a 95 % interval.
_INTERVAL = 1.96


def has_insignificant_cause(fit: CandidateFit, errors: Array) -> bool:
    """Whether the 95 % intervals of all sizes of some cause hold the aircraft file's values.

    Each cause is judged by its most significant size, with the insignificant ones at the file's values. ``errors`` as
    in ``insignificant_sizes``.
    """
    held = [fit.indices.index(i) for i in insignificant_sizes(fit, errors)]
    ratios = np.abs(_ratios(*_away(fit, errors), held))
    sizes = [[k for k in map(fit.indices.index, c.indices) if fit.sizing[k]] for c in fit.candidates]
    return any(max(ratios[own]) <= _INTERVAL for own in sizes if own)


def insignificant_sizes(fit: CandidateFit, errors: Array) -> tuple[int, ...]:
    """Entries of the parameter vector of a cause's sizes whose 95 % intervals hold the aircraft file's values.

    ``errors`` (K,) are the standard errors of the candidates' parameters as they are stated, which may be larger than
    those of the fit; the correlations are the fit's. Sizes are found one at a time, the least significant first, the
    others free (backward elimination: Klein & Morelli (2006), Aircraft System Identification, sect. 5.4). Each cause
    keeps its most significant size.
    """
    chosen, held = list(fit.indices), list[int]()
    away, covariance = _away(fit, errors)
    while True:
        ratios = _ratios(away, covariance, held)
        kept = {
            max((chosen.index(i) for i in c.indices), key=lambda k: abs(ratios[k])) for c in fit.candidates if c.indices
        }
        rest = [k for k in np.flatnonzero(fit.sizing).tolist() if k not in held and k not in kept]
        least = min(rest, key=lambda k: abs(ratios[k]), default=None)
        if least is None or abs(ratios[least]) > _INTERVAL:
            return tuple(chosen[k] for k in held)
        held.append(least)


def restricted(fit: CandidateFit, held: Sequence[int]) -> CandidateFit:
    """The fit with these entries of its sizes at the aircraft file's values, and all else where it is best then."""
    return _moved(fit, *_sizes_to_file(fit, held))


def beside_file_derivatives(fit: CandidateFit, held: Sequence[int] = ()) -> CandidateFit:
    """The fit with the derivatives at the aircraft file's values, and all else where it is best then.

    Sizes are correlated with the derivatives that were fitted with them: those of one belong to those of the other.
    Derivatives that are a cause stay free. These entries of the sizes are ``held`` at the file's values, too.
    """
    shared = [i for i, s in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if s]
    derivatives = np.array([k for k in fit.derivative_places if shared[k] not in fit.widened], int)
    places, step = _sizes_to_file(fit, held)
    places = np.append(places, len(fit.indices) + derivatives)
    return _moved(fit, places, np.append(step, -fit.stacked[0][derivatives]))


def _sizes_to_file(fit: CandidateFit, held: Sequence[int]) -> tuple[NDArray[np.intp], Array]:
    """Places among the unknowns of these entries of the sizes, and the step that takes them to the file's values."""
    places = np.array([fit.indices.index(i) for i in held], int)
    return places, fit.simulator.neutral()[list(held)] - fit.values[places]


def _moved(fit: CandidateFit, places: NDArray[np.intp], by: Array) -> CandidateFit:
    """The fit after a step of the unknowns at these ``places``, and all else where it is best then.

    Restricted least squares (Seber & Lee (2003), Linear Regression Analysis, sect. 3.8.1). The information stays that
    of the fit in which nothing is held: the standard errors do not forget that it was not known before.
    """
    assert fit.information is not None
    free = np.setdiff1d(np.arange(fit.information.shape[0]), places)
    step = np.zeros(fit.information.shape[0])
    step[places] = by
    normal, right = fit.information[np.ix_(free, free)], fit.information[np.ix_(free, places)] @ step[places]
    step[free] = -np.linalg.solve(normal, right)
    return replace(linearised(stepped(fit, step)), information=fit.information)


def _away(fit: CandidateFit, errors: Array) -> tuple[Array, Array]:
    """How far the sizes (K,) are from the aircraft file's, and their covariance (K, K) with these standard errors."""
    count = len(fit.indices)
    covariance = fit.covariance[:count, :count]
    larger = errors / np.sqrt(np.diag(covariance))
    return fit.values - fit.simulator.neutral()[list(fit.indices)], covariance * np.outer(larger, larger)


def _ratios(away: Array, covariance: Array, held: Sequence[int]) -> Array:
    """Sizes (K,) in their standard errors, with some held at zero; those that are held are zero."""
    information = np.linalg.inv(covariance)
    free = np.setdiff1d(np.arange(away.size), held).astype(int)
    ratios, normal = np.zeros(away.size), information[np.ix_(free, free)]
    best = away[free] + np.linalg.solve(normal, information[np.ix_(free, np.array(held, int))] @ away[list(held)])
    ratios[free] = best / np.sqrt(np.diag(np.linalg.inv(normal)))
    return ratios
