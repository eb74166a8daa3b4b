"""Whether flights are long enough: what moves no faster than a band's edge takes only so many independent values.

A signal below B Hz is known by 2 B values a second (the sampling theorem), however often it was read. Where these are
no more than the unknowns, any model passes through all of them, and what is left over says nothing of the errors.
"""

from __future__ import annotations

from collections.abc import Sequence

from sysid_node.errors import InputError
from sysid_node.flight.record import Array


def effective_degrees_of_freedom(names: Sequence[str], times: Sequence[Array], low_pass: float) -> float:
    """How many independent values below ``low_pass`` Hz (0: all) flights sampled at ``times`` (N,) s hold beyond the
    unknowns of one equation.

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
