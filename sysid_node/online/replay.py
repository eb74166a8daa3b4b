"""Estimates along aligned samples that are at hand, by the same calls in the same order as in the live node.

It calls ``update`` with every sample and ``estimate`` where an estimate falls due. ``api.replaying`` does the same with
the samples of a recording that is read in pieces.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.types import Estimates

Array = NDArray[np.float64]
REPORT_EVERY = 512  # samples between reports of progress


def run(
    aircraft: Aircraft,
    settings: OnlineSettings,
    time: Array,
    samples: Array,
    publish_times: Array,
    progress: Callable[[float], None] | None = None,
    commands_from: int | None = None,
    command_interval: float = 0.0,
) -> list[Estimates]:
    """Estimates as they stand after the first sample at or past each of ``publish_times`` (K,) s, at most one a sample.

    ``time`` (N,) s, increasing; ``samples`` (N, M) as ``estimator.update`` takes them. ``progress`` is called with the
    time (s) of the last sample, every ``REPORT_EVERY`` samples and at the end. ``commands_from``: the place of the
    first sample whose deflections follow from commands; the estimator begins anew there. ``command_interval`` (s) as of
    ``estimator.init``.
    """
    return run_to_end(aircraft, settings, time, samples, publish_times, progress, commands_from, command_interval)[0]


def run_to_end(
    aircraft: Aircraft,
    settings: OnlineSettings,
    time: Array,
    samples: Array,
    publish_times: Array,
    progress: Callable[[float], None] | None = None,
    commands_from: int | None = None,
    command_interval: float = 0.0,
) -> tuple[list[Estimates], EstimatorState]:
    """The estimates of ``run``, and the estimator as it stands after the last sample, with nothing left to renew."""
    state = estimator.init(aircraft, settings, command_interval=command_interval)
    due = set(np.searchsorted(time, publish_times, side="left").tolist())
    estimates = []
    for i, moment in enumerate(time.tolist()):
        if i == commands_from:
            state = estimator.begin_with_commands(state, moment)
        estimator.update(state, moment, samples[i].tolist())
        if i in due:
            estimates.append(estimate(state, moment))
        if progress is not None and ((i + 1) % REPORT_EVERY == 0 or i + 1 == time.size):
            progress(moment)
    estimator.complete(state)
    return estimates, state
