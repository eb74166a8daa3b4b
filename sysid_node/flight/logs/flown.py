"""The part of a log in which the aircraft flew, as a fixed wing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.streams import Stamps

Mask = NDArray[np.bool_]

#: Start and end of each part, ns.
Spans = tuple[tuple[int, int], ...]


class Condition(NamedTuple):
    """Whether something held from each stamp (N,) until the next; before the first, what held at the first."""

    stamp_ns: Stamps
    holds: Mask


def spans_where(conditions: Sequence[Condition], end_ns: int) -> Spans | None:
    """The times until ``end_ns`` at which all conditions hold; None where there is none that says anything."""
    known = [condition for condition in conditions if condition.stamp_ns.size]
    if not known:
        return None
    edges = np.unique(np.concatenate([condition.stamp_ns for condition in known]))
    every = np.ones(edges.size, bool)
    for condition in known:
        place = np.maximum(np.searchsorted(condition.stamp_ns, edges, side="right") - 1, 0)
        every &= condition.holds[place]
    ends = np.append(edges[1:], max(end_ns, int(edges[-1])) + 1)
    spans: list[tuple[int, int]] = []
    for start, end in zip(edges[every].tolist(), ends[every].tolist(), strict=True):
        if spans and spans[-1][1] == start:
            spans[-1] = (spans[-1][0], end)
        else:
            spans.append((start, end))
    return tuple(spans)


def within(spans: Spans | None, stamp_ns: Stamps) -> Mask:
    """Which stamps (N,) lie in one of the spans; all where these are not known."""
    if spans is None:
        return np.ones(stamp_ns.size, bool)
    inside = np.zeros(stamp_ns.size, bool)
    for start, end in spans:
        inside |= (stamp_ns >= start) & (stamp_ns < end)
    return inside


def seconds(spans: Spans) -> float:
    """The length of all spans together, s."""
    return sum(end - start for start, end in spans) / 1e9
