"""Flow angles of flights without vanes.

They come from the online estimator's kinematic filter (``online.alignment.flow_angle_filter``): integrals of the IMU,
corrected slowly by the lift and side force of the aircraft file. So they share the IMU's clock and errors, do not
contain gusts, and are no measurements that could be compared. Their mean is that of the aircraft file; its error, by
which lift is mistaken for drag, is a nuisance parameter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.types import SAMPLE_COLUMNS

ANGLES = ("alpha", "beta")

_NEEDED = ("ax", "ay", "az", "p", "q", "r", "V", "rho")
_LONGEST_STEP = 0.5  # s


def missing_flow_angles(record: FlightRecord) -> tuple[str, ...]:
    """The flow angles of which a record has no value."""
    return tuple(name for name in ANGLES if not record.measured(name))


def with_inferred_angles(
    aircraft: Aircraft, record: FlightRecord, angles: tuple[str, ...], source: str
) -> FlightRecord:
    """The record with these angles (rad) inferred. Raises InputError where they cannot be."""
    absent = [name for name in _NEEDED if not np.isfinite(record[name]).all()]
    if absent:
        raise InputError(f"{source}: no {' or '.join(angles)}, and no complete {', '.join(absent)} to infer them from")
    filter_ = flow_angle_filter.init(aircraft)
    if filter_.model is None:
        raise InputError(
            f"{source}: no {' or '.join(angles)}; they can be inferred where the aircraft file has CL_alpha and CY_beta"
        )
    samples = _samples(aircraft, record, angles)
    filled = flow_angle_filter.complete_many(filter_, record.time, samples, _LONGEST_STEP)
    columns = {name: filled[:, SAMPLE_COLUMNS.index(name)] for name in angles}
    return replace(record, columns={**record.columns, **columns})


def _samples(aircraft: Aircraft, record: FlightRecord, angles: tuple[str, ...]) -> Array:
    """Samples (N, M) as the online estimator takes them; attitude that was not measured is set to zero."""
    step = np.gradient(record.time)
    known = {**record.columns, "air_interval": step, **dict.fromkeys(angles, np.full(len(record), np.nan))}
    columns = [known.get(name, np.zeros(len(record))) for name in (*SAMPLE_COLUMNS, *aircraft.control_symbols)]
    samples = np.column_stack(columns)
    others = [i for i, name in enumerate((*SAMPLE_COLUMNS, *aircraft.control_symbols)) if name not in angles]
    samples[:, others] = np.nan_to_num(samples[:, others])
    return samples
