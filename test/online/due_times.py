"""The times of a whole flight at which estimates fall due, by the schedule of the live node."""

import numpy as np

from sysid_node.online.alignment.schedule import Schedule, due


def due_times(time: np.ndarray, wait: np.ndarray, rate: float) -> np.ndarray:
    """Those of the samples' times (N,) s, increasing, at which an estimate falls due; see ``due``."""
    schedule = Schedule(rate)
    return time[[due(schedule, t, w) for t, w in zip(time.tolist(), wait.tolist(), strict=True)]]
