"""Log Bayes factors of two explanations under a likelihood that gusts cannot influence.

Rotating air is in every flight and obeys the same law in each. An effect that only changes how the aircraft answers
gusts (a structural mode, other moments of inertia) therefore predicts flights held out as well, and the better the
longer they are. It explains nothing of what is coherent with the commands, however. Air data and attitude are predicted
from the inertial instruments, which contain no such air, and count whole.

The sum of squares of the moment equations stands for minus twice a log likelihood (the limited-information likelihood:
Kim (2002), Journal of Econometrics 107(1)), with the unknowns within their limits, and Laplace's approximation makes it
the log evidence.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.instruments.gust_free_signals import command_instruments
from sysid_node.gap.instruments.moment_equations import limited_step, moment_equations, prior_terms
from sysid_node.gap.instruments.overidentification import overidentification_of


def log_bayes_factor(fit: CandidateFit, other: CandidateFit) -> float:
    """Nats by which a fit explains better than another what is coherent with the commands.

    The noise is that which the first fit leaves; by channel it includes what stays coherent beyond chance, because a
    model that is not exact is no more certain than it predicts (quasi-likelihood: Burnham & Anderson (2002), Model
    Selection and Multimodel Inference, sect. 2.5).
    """
    powers = _noise(fit)
    return _log_evidence(fit, powers) - _log_evidence(other, powers)


def log_bayes_factor_of_alternatives(fit: CandidateFit, other: CandidateFit) -> float:
    """The same of two explanations of which neither contains the other, in their pooled noise.

    In the noise that one of them leaves, which is least where this one fits best, it would be favoured, and so would
    the other in its own.
    """
    pairs = zip(_noise(fit), _noise(other), strict=True)
    powers = tuple(0.5 * (mine + theirs) for mine, theirs in pairs)
    return _log_evidence(fit, powers) - _log_evidence(other, powers)


def _noise(fit: CandidateFit) -> tuple[Array, ...]:
    """Power (L, 12) by flight of the noise that a fit leaves, with what stays coherent with the commands."""
    test = overidentification_of(fit)
    scatter = 1.0 + test.coherent / (0.5 * test.chance**2)
    return tuple(power * scatter for power in fit.powers)


def _log_evidence(fit: CandidateFit, powers: Sequence[Array]) -> float:
    """Log evidence, up to a constant, in noise of these powers (L, 12) by flight."""
    equations = moment_equations(fit, powers, command_instruments, whole=True)
    step = limited_step(equations, fit)
    squares = equations.constant - 2.0 * float(equations.right @ step) + float(step @ equations.information @ step)
    precision, _ = prior_terms(fit)
    _, volume = np.linalg.slogdet(equations.information)
    chosen = sum(candidate.log_choices for candidate in fit.candidates)
    return -0.5 * (squares + float(volume) - float(np.log(precision).sum())) - chosen
