"""Whether commands move in steps or smoothly, which decides how often they must be logged."""

from __future__ import annotations

import numpy as np

from sysid_node.flight.commanded import AROUND, ISOLATED
from sysid_node.flight.record import Array

#: Commands move in steps where at least this share of a control's movement is in steps.
MOSTLY = 0.4


def share_in_steps(commands: Array) -> float:
    """The largest share (0..1) of any control's movement that is in steps, from its samples (N, C).

    A step is a change from one sample to the next that is 8 times as large as the two before and the two after it; the
    movement is the sum of all changes. Manoeuvres such as doublets and 3-2-1-1 consist of steps, the commands of a
    controller, a stick or a multisine do not.
    """
    changes = np.abs(np.diff(commands, axis=0))
    count = len(changes) - 2 * AROUND
    if count < 1:
        return 0.0
    middle = changes[AROUND : AROUND + count]
    step = middle > 0.0
    for i in range(2 * AROUND + 1):
        if i != AROUND:
            step &= changes[i : i + count] * ISOLATED < middle
    total = np.nansum(changes, axis=0)
    in_steps = np.nansum(np.where(step, middle, 0.0), axis=0)
    shares = np.divide(in_steps, total, out=np.zeros_like(total), where=total > 0.0)
    return float(shares.max(initial=0.0))
