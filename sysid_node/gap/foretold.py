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

from sysid_node.gap.fit import Fit
from sysid_node.gap.structure import equations, priors, within_limits


def advantage(fit: Fit, other: Fit) -> float:
    """Nats by which a fit accounts better than another for what commands foretell, in the noise that it leaves."""
    return _evidence(fit, fit) - _evidence(other, fit)


def _evidence(fit: Fit, like: Fit) -> float:
    """Log evidence, up to a constant, in the noise levels of ``like``."""
    seen = equations(fit, like.power, readings=True)
    step = within_limits(seen, fit)
    squares = seen.constant - 2.0 * float(seen.right @ step) + float(step @ seen.information @ step)
    precision, _ = priors(fit)
    _, volume = np.linalg.slogdet(seen.information)
    return -0.5 * (squares + float(volume) - float(np.log(precision).sum()))
