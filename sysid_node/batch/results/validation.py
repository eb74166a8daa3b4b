"""Figures of merit of a model on a flight, output by output.

Jategaonkar (2015), ch. 11; Klein & Morelli (2006), sec. 6.4. All refer to the measurement about its mean, so
that a large constant airspeed does not improve them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from sysid_node.batch.results.response import ModelResponse
from sysid_node.flight.record import Array

#: Longest lag of the correlations, as a share of the flight.
_LAG_SHARE = 0.1


def figures_of_merit(response: ModelResponse, inputs: Mapping[str, Array]) -> dict[str, dict[str, float]]:
    """The figures of each output by name, on the samples where the output was measured.

    ``normalised_error`` RMS of the residual over that of the measurement; ``theil`` Theil's inequality coefficient
    (0 equal, 1 unrelated); ``r_squared``; ``whiteness`` share of the residual's autocorrelations within the 95 % band
    of white noise (0.95 where white); ``input_correlation`` the largest correlation between the residual and an input
    (N,) at any lag up to a tenth of the flight. NaN where an output was constant, measured less than ten times, or
    modelled without a finite value.
    """
    table = {}
    for column, name in enumerate(response.names):
        measured, modelled = response.measured[:, column], response.modelled[:, column]
        kept = np.isfinite(measured)
        chosen = {key: values[kept] for key, values in inputs.items()}
        table[name] = _figures_of_output(measured[kept], modelled[kept], chosen)
    return table


def _figures_of_output(measured: Array, modelled: Array, inputs: Mapping[str, Array]) -> dict[str, float]:
    names = ("normalised_error", "theil", "r_squared", "whiteness", "input_correlation")
    if measured.size < 10 or not np.isfinite(modelled).all() or np.ptp(measured) == 0.0:
        return dict.fromkeys(names, float("nan"))
    mean = measured.mean()
    residual = measured - modelled
    error, spread, response = (float(np.sqrt(np.mean(x**2))) for x in (residual, measured - mean, modelled - mean))
    values = (error / spread, error / (spread + response), 1.0 - (error / spread) ** 2)
    centred = residual - residual.mean()
    correlations = [_largest_correlation(centred, x - x.mean()) for x in inputs.values()]
    return dict(zip(names, (*values, _whiteness(centred), max(correlations, default=float("nan"))), strict=True))


def _whiteness(residual: Array) -> float:
    """Share of lags whose autocorrelation is within 1.96 / sqrt(N); 1 for a residual of zero."""
    products = _correlation(residual, residual)
    if products[0] <= 0.0:
        return 1.0
    lags = products[1 : 1 + max(1, int(_LAG_SHARE * residual.size))] / products[0]
    return float(np.mean(np.abs(lags) < 1.96 / np.sqrt(residual.size)))


def _largest_correlation(residual: Array, x: Array) -> float:
    """Largest correlation coefficient with ``x`` earlier than the residual by any lag, zero for a constant ``x``."""
    size = float(np.sqrt(np.sum(residual**2) * np.sum(x**2)))
    if size == 0.0:
        return 0.0
    return float(np.abs(_correlation(x, residual)[: 1 + int(_LAG_SHARE * residual.size)]).max() / size)


def _correlation(a: Array, b: Array) -> Array:
    """sum_k a(k) b(k + m) for m = 0, 1, ... (N,)."""
    size = next_fast_len(2 * a.size, real=True)
    return np.asarray(irfft(rfft(a, size).conj() * rfft(b, size), size)[: a.size])
