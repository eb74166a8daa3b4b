"""Flow angles of flights without vanes.

They come from the online estimator's kinematic filter (``online.alignment.flow_angle_filter``): integrals of the IMU,
corrected slowly by the lift and side force of the aircraft file. So they share the IMU's clock and errors, do not
contain gusts, and are no measurements that could be compared. Their mean is that of the aircraft file; its error, by
which lift is mistaken for drag, is a nuisance parameter. How the filter was corrected is kept, so that the angles can
follow other errors of the instruments (``inferred_flow``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.alignment.flow_angle_equations import velocity_at_cg
from sysid_node.online.alignment.flow_angle_filter import FlowAngleFilter
from sysid_node.online.alignment.flow_angle_model import FlowAngleModel
from sysid_node.online.types import SAMPLE_COLUMNS

ANGLES = ("alpha", "beta")

#: Entries of the filter's state: the velocity (m/s) along body axes, roll and pitch angle (rad), biases of p, q and az.
STATES = 8

_NEEDED = ("ax", "ay", "az", "p", "q", "r", "V", "rho")
_LONGEST_STEP = 0.5  # s


@dataclass(frozen=True)
class FilterHistory:
    """What the filter of a flight did at each of its N samples."""

    time: Array  # (N,) s
    states: Array  # (N, 8) after the sample, the velocity that of the CG
    gains: Array  # (N, 8, 3) of the mean differences of airspeed (m/s), alpha and beta (rad) since the last correction
    corrects: NDArray[np.bool_]  # (N,) whether it was corrected
    begins: NDArray[np.bool_]  # (N,) whether it was begun
    angles: tuple[str, ...]  # those that are inferred

    def between(self, begin: float, end: float) -> FilterHistory:
        """The part between two times, s, begun with the state that the filter had there; its time begins at zero."""
        kept = (self.time >= begin) & (self.time <= end)
        time, states, gains = self.time[kept], self.states[kept], self.gains[kept]
        begins = self.begins[kept] | (np.arange(time.size) == 0)
        return FilterHistory(time - time[0], states, gains, self.corrects[kept] & ~begins, begins, self.angles)


def missing_flow_angles(record: FlightRecord) -> tuple[str, ...]:
    """The flow angles of which a record has no value."""
    return tuple(name for name in ANGLES if not record.measured(name))


def run_flow_angle_filter(
    aircraft: Aircraft, record: FlightRecord, angles: tuple[str, ...], source: str
) -> tuple[FlightRecord, FilterHistory]:
    """The record with these angles (rad) inferred, and how. Raises InputError where they cannot be."""
    absent = [name for name in _NEEDED if not np.isfinite(record[name]).all()]
    if absent:
        raise InputError(f"{source}: no {' or '.join(angles)}, and no complete {', '.join(absent)} to infer them from")
    filter_ = flow_angle_filter.init(aircraft)
    if filter_.model is None:
        raise InputError(
            f"{source}: no {' or '.join(angles)}; they can be inferred where the aircraft file has CL_alpha and CY_beta"
        )
    filled, history = _filtered(filter_, filter_.model, record.time, _samples(aircraft, record, angles), angles)
    columns = {name: filled[:, SAMPLE_COLUMNS.index(name)] for name in angles}
    return replace(record, columns={**record.columns, **columns}), history


def _filtered(
    filter_: FlowAngleFilter, model: FlowAngleModel, time: Array, samples: Array, angles: tuple[str, ...]
) -> tuple[Array, FilterHistory]:
    """Samples (N, M) at ``time`` (N,) s with what the filter makes of them, and how."""
    filled, states = [], np.zeros((time.size, STATES))
    gains, corrects, begins = np.zeros((time.size, STATES, 3)), np.zeros(time.size, bool), np.zeros(time.size, bool)
    for i, (now, sample) in enumerate(zip(time.tolist(), samples.tolist(), strict=True)):
        filled.append(flow_angle_filter.complete(filter_, now, sample, _LONGEST_STEP))
        if not filter_.state:  # no reading of a flight has come yet
            continue
        states[i] = [*velocity_at_cg(filter_.state, model, sample), *filter_.state[3:]]
        if filter_.innovations.since == now:
            corrects[i], begins[i] = filter_.gain.size > 0, filter_.gain.size == 0
            gains[i] = filter_.gain if corrects[i] else 0.0
    return np.array(filled), FilterHistory(time, states, gains, corrects, begins, angles)


def _samples(aircraft: Aircraft, record: FlightRecord, angles: tuple[str, ...]) -> Array:
    """Samples (N, M) as the online estimator takes them; attitude that was not measured is set to zero."""
    step = np.gradient(record.time)
    known = {**record.columns, "air_interval": step, **dict.fromkeys(angles, np.full(len(record), np.nan))}
    columns = [known.get(name, np.zeros(len(record))) for name in (*SAMPLE_COLUMNS, *aircraft.control_symbols)]
    samples = np.column_stack(columns)
    others = [i for i, name in enumerate((*SAMPLE_COLUMNS, *aircraft.control_symbols)) if name not in angles]
    samples[:, others] = np.nan_to_num(samples[:, others])
    return samples
