"""The servos that reach their rate limits in a flight as the batch methods take it."""

from __future__ import annotations

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults.hypotheses import rate_limits
from sysid_node.faults.model import blocks, residual_whitening
from sysid_node.faults.model.terms import design_of, terms
from sysid_node.faults.types import Fault
from sysid_node.flight.record import FlightRecord
from sysid_node.online.types import SAMPLE_COLUMNS

RENEWED = 10  # blocks between updates of the whitening
MEMORY = 60.0  # s, time constant of the residuals' autocorrelation


def rate_limits_of(aircraft: Aircraft, flight: FlightRecord) -> list[Fault]:
    """Those at the flight's end; none where the flight lacks a control or a signal.

    As in flight, but the residuals that are whitened are those of the aircraft file's derivatives.
    """
    columns = [*SAMPLE_COLUMNS, *aircraft.control_symbols]
    known = {**flight.columns, "air_interval": np.zeros(len(flight))}
    if not all(name in known and (name == "thrust" or np.isfinite(known[name]).any()) for name in columns):
        return []
    samples = np.column_stack([known[name] for name in columns])
    averaged = blocks.init(aircraft)
    model = terms(aircraft, averaged.layout)
    state, whitening = rate_limits.init(aircraft, model), residual_whitening.init(MEMORY, blocks.PERIOD)
    for moment, sample in zip(flight.time.tolist(), samples.tolist(), strict=True):
        rate_limits.move(state, moment, sample)
        block = blocks.add(averaged, moment, sample)
        if block is None:
            continue
        design = design_of(model, model.values, block.regressors, block.behind)
        residual_whitening.learn(whitening, block.outputs - design @ model.values, block.follows)
        if (state.blocks + 1) % RENEWED == 0:
            residual_whitening.settle(whitening)
        rate_limits.take(state, block, whitening.filter)
    return state.faults
