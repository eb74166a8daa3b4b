"""Evidence that no gust can give: how much better an explanation accounts for what the commands foretell.

Air that turns is in every flight and obeys the same law in each. So what merely answers to gusts as the aircraft does
(a mode that rings, other moments of inertia) predicts flight held out as well, and all the better the longer it is. Of
what the commands foretell it explains nothing. Air data and attitude, predicted from the inertial instruments, know no
such air and count whole. The sum of squares of the instruments' equations
(``structure``) stands for minus twice a log likelihood (Kim (2002), Journal of Econometrics 107(1): the limited
information likelihood), unknowns within their limits, and Laplace's approximation makes it evidence.
"""

from __future__ import annotations

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.fit import CandidateFit
from sysid_node.gap.instruments.overidentification import (
    command_instruments,
    limited_step,
    moment_equations,
    overidentification_of,
    prior_terms,
)


def log_bayes_factor(fit: CandidateFit, other: CandidateFit) -> float:
    """Nats by which a fit accounts better than another for what commands foretell, in the noise that it leaves.

    What stays beyond chance counts as noise by channel: a model that is not exact knows no better than it predicts
    (quasi-likelihood: Burnham & Anderson (2002), Model Selection, sect. 2.5).
    """
    left = overidentification_of(fit)
    scatter = 1.0 + left.coherent / (0.5 * left.chance**2)
    powers = tuple(power * scatter for power in fit.power)
    return _evidence(fit, powers) - _evidence(other, powers)


def _evidence(fit: CandidateFit, powers: tuple[Array, ...]) -> float:
    """Log evidence, up to a constant, in noise of these powers (L, 12) by flight."""
    seen = moment_equations(fit, powers, command_instruments, whole=True)
    step = limited_step(seen, fit)
    squares = seen.constant - 2.0 * float(seen.right @ step) + float(step @ seen.information @ step)
    precision, _ = prior_terms(fit)
    _, volume = np.linalg.slogdet(seen.information)
    return -0.5 * (squares + float(volume) - float(np.log(precision).sum()))
