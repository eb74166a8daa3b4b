"""The effective degrees of freedom of flights, and whether they suffice for a regression.

A signal below B Hz is determined by 2 B values a second (the sampling theorem), however fast it is sampled. Where these
are no more than the unknowns, a model fits them all exactly, and the residuals say nothing of the errors.
"""

from __future__ import annotations

from collections.abc import Sequence

from sysid_node.errors import InputError
from sysid_node.flight.record import Array


def effective_degrees_of_freedom(names: Sequence[str], times: Sequence[Array], low_pass: float) -> float:
    """The number of independent values of flights sampled at ``times`` (N,) s, less the unknowns ``names``.

    Only what is below ``low_pass`` Hz counts; 0 counts every sample.

    Raises InputError where it is less than one.
    """
    seconds = independent = 0.0
    for time in times:
        duration = float(time[-1] - time[0])
        seconds += duration
        independent += min(2.0 * low_pass * duration, time.size - 1.0) if low_pass > 0.0 else time.size - 1.0
    if independent - len(names) < 1.0:
        band = f" below {low_pass:g} Hz" if low_pass > 0.0 else ""
        raise InputError(
            f"{seconds:.3g} s of flight is too short: it holds {independent:.0f} independent values{band}, too few "
            f"for the {len(names)} unknowns of one equation ({', '.join(names)}); give a longer flight"
        )
    return independent - len(names)
