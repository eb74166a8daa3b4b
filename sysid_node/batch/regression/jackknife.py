"""The covariance of an estimate by the block jackknife: one stretch of the record is left out at a time.

The delete-a-block jackknife (Kuensch, "The jackknife and the bootstrap for general stationary observations", Annals of
Statistics 17, 1989), each estimate without a block being one Gauss-Newton step away (Bell & McCaffrey, "Bias reduction
in standard errors for linear regression with multi-stage samples", Survey Methodology 28, 2002):

    Cov = (B - 1) / B sum_b d_b d_b',   d_b = (I - I_b)^-1 g_b

with g_b the score and I_b the information of block b. Residuals and sensitivities may depend on each other, as long as
that dependence dies out within a block. A filter needs this: its sensitivities are functions of the measurements, gusts
included, and its residuals may be larger where the sensitivities are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.flight.record import Array

#: Number of blocks of all records together; the scatter is then known to about a tenth.
BLOCKS = 40


def jackknife(
    information: Array, sensitivities: Sequence[Array], residuals: Sequence[Array], blocks: int = BLOCKS
) -> tuple[Array, float]:
    """The covariance (P, P) and its degrees of freedom.

    ``information`` (P, P), priors included; ``sensitivities`` (N, ny, P) and ``residuals`` (N, ny) of each manoeuvre,
    divided by the noise level of each output and zero where nothing was measured. No block spans two manoeuvres.
    """
    length = max(1, round(sum(map(len, residuals)) / blocks))
    scale = np.sqrt(np.where(np.diag(information) > 0.0, np.diag(information), 1.0))
    whole = information / np.outer(scale, scale)
    steps = []
    for slopes, errors in zip(sensitivities, residuals, strict=True):
        pieces = max(1, round(len(errors) / length))
        for S, v in zip(np.array_split(slopes / scale, pieces), np.array_split(errors, pieces), strict=True):
            rest = whole - np.tensordot(S, S, axes=([0, 1], [0, 1]))
            steps.append(np.linalg.pinv(rest, rcond=1e-10, hermitian=True) @ np.tensordot(S, v, axes=([0, 1], [0, 1])))
    moved, count = np.array(steps) / scale, len(steps)
    return np.asarray((count - 1) / count * moved.T @ moved), float(max(count - 1, 1))
