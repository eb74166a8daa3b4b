"""Flight records as the data of a model, whole or cut into segments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.models.manoeuvre import ManoeuvreData, block_means
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.models.rigid_body import AT_CG
from sysid_node.batch.regression.filtering import differentiate
from sysid_node.batch.regression.measured_coefficients import at_cg
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

_FEWEST = 5  # samples in a piece of flight

#: Outputs that no sensor gives: derivatives of measured columns.
_DERIVED = {"pdot": "p", "qdot": "q", "rdot": "r"}


def manoeuvre_data(
    model: StateSpaceModel, record: FlightRecord, initial_state: Mapping[str, float] | None = None, every: int = 1
) -> ManoeuvreData:
    """The record's columns as inputs, outputs and initial state of ``model``.

    Columns are found by name; pdot, qdot and rdot are differentiated where the record lacks them. The initial state is
    the first measured value, unless ``initial_state`` gives it; a state that was never measured starts at zero.
    Outputs are averaged over ``every`` samples. Raises InputError where an input was not measured.
    """
    missing = [name for name in model.inputs if not record.measured(name)]
    if missing:
        measured = ", ".join(name for name in record.columns if record.measured(name))
        raise InputError(
            f"flight {record.name!r}: model {model.name} needs {', '.join(missing)}, which it did not measure; "
            f"it has {measured}"
        )
    given = initial_state or {}
    start = np.array([given.get(name, _first(record[name])) for name in model.states])
    inputs = np.column_stack([record[name] for name in model.inputs])
    outputs = np.column_stack([_output(record, name) for name in model.outputs])
    time = record.time - record.time[0]
    return ManoeuvreData(time, inputs, block_means(outputs, every), start, record.name or "flight", every)


def record_for_model(model: StateSpaceModel, aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record with the columns that ``model`` derives from others: forces at the CG, and the reference's density."""
    if set(AT_CG) & set(model.inputs):
        record = with_forces_at_cg(aircraft, record)
    if record.measured("rho"):
        return record
    density = np.full(len(record), aircraft.reference.air_density)
    return replace(record, columns={**record.columns, "rho": density})


def with_forces_at_cg(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record with the specific forces at the CG as further columns, for models that take them as inputs."""
    moved = at_cg(aircraft, record)
    columns = {**record.columns, **dict(zip(AT_CG, (moved["ax"], moved["ay"], moved["az"]), strict=True))}
    return FlightRecord(record.time, columns, record.name, record.start_ns, record.rejected)


def cut_into_segments(record: FlightRecord, seconds: float) -> list[FlightRecord]:
    """The record in pieces of equal length, none longer than ``seconds``; 0 leaves it whole.

    A long open-loop rollout drifts because of small errors of trim and wind; pieces with initial states of their own do
    not. Pieces of equal length share one compiled program, so that some samples at the end may be left over. Raises
    InputError where a piece would have too few samples.
    """
    if len(record) < _FEWEST:
        raise InputError(f"flight {record.name!r}: {len(record)} samples; give at least {_FEWEST}, better some seconds")
    if not seconds > 0.0:
        return [record]
    pieces = max(1.0, np.ceil(record.duration / seconds - 1e-9))
    if len(record) // pieces < _FEWEST:
        raise InputError(
            f"flight {record.name!r}: {len(record)} samples in {record.duration:.1f} s cannot be cut into segments of "
            f"{seconds:g} s; give longer segments"
        )
    count = int(pieces)
    edges = len(record) // count * np.arange(count + 1)
    return [_piece(record, first, last, k, count) for k, (first, last) in enumerate(pairwise(edges.tolist()))]


def _piece(record: FlightRecord, first: int, last: int, index: int, pieces: int) -> FlightRecord:
    name = record.name if pieces == 1 else f"{record.name or 'flight'} [{index + 1}/{pieces}]"
    columns = {key: values[first:last] for key, values in record.columns.items()}
    return FlightRecord(record.time[first:last], columns, name, record.start_ns, record.rejected)


def _output(record: FlightRecord, name: str) -> Array:
    if name in _DERIVED and not record.measured(name):
        return differentiate(record.time, record[_DERIVED[name]])
    return record[name]


def _first(values: Array) -> float:
    """The first measured value, or zero."""
    measured = values[np.isfinite(values)]
    return float(measured[0]) if measured.size else 0.0
