"""Single stamps of a log that are of another time than those around them, as where a bit was flipped on the card."""

from __future__ import annotations

import numpy as np

from sysid_node.flight.logs.flown import Mask
from sysid_node.flight.streams import Stamps

_FAR_NS = 1_000_000_000


def in_order(stamp_ns: Stamps) -> Mask:
    """Which stamps (N,), ns, to keep: all but single ones.

    A single one is more than a second off the two around it, which are within a second of each other, or is the first
    and later, or the last and earlier, than those beside it. A clock that was set moves all stamps that follow.
    """
    keep = np.ones(stamp_ns.size, bool)
    if stamp_ns.size < 3:
        return keep
    steps = np.diff(stamp_ns)
    around = np.abs(stamp_ns[2:] - stamp_ns[:-2]) <= _FAR_NS
    keep[1:-1] = ~(around & (np.abs(steps[1:]) > _FAR_NS) & (np.abs(steps[:-1]) > _FAR_NS))
    keep[0] = steps[0] >= -_FAR_NS or abs(steps[1]) > _FAR_NS
    keep[-1] = steps[-1] >= -_FAR_NS or abs(steps[-2]) > _FAR_NS
    return keep


def said_of(count: int) -> tuple[str, ...]:
    """What was done, a sentence; nothing where nothing was."""
    return (f"{count} messages with a stamp of another time than those around them are left out",) if count else ()
