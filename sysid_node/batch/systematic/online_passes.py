"""The online estimator, passed along flights of which a batch method estimates the derivatives.

Its instruments and iterated servos stand more than most batch methods do: gusts, and times that are off by more than a
linear correction can mend. So it tells what the flights know of the imperfections (``flight_posterior``), and what
gusts do to a method (``gust_bias``). Flights with commands and flights with measured positions have no servos in
common: each kind has a pass of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.settings import BatchSettings
from sysid_node.flight.record import FlightRecord
from sysid_node.online import estimator
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import LONGEST_GAP, OnlineSettings
from sysid_node.online.state import EstimatorState
from sysid_node.online.types import SAMPLE_COLUMNS

APART = 2.0 * LONGEST_GAP  # s between flights: the estimator begins a segment after such a gap
OK = "ok"


class OnlineEstimate(NamedTuple):
    """A derivative as the online estimator has it after the flights."""

    value: float
    standard_error: float
    statistical_error: float
    status: str
    gusts: float  # share of the coefficient's residual that is not the sensors' noise, 0 to 1

    @property
    def valid(self) -> bool:
        """Whether the online estimator takes it for valid."""
        return self.status == OK


def online_passes(
    aircraft: Aircraft, records: Sequence[FlightRecord], settings: BatchSettings
) -> tuple[EstimatorState, ...]:
    """The online estimator after the ``records``: those with commands, and those with positions."""
    online = OnlineSettings(actuators=settings.actuators, max_gap=min(settings.max_gap, 5.0), detect_changes=False)
    alike = ([one for one in records if one.commanded == commanded] for commanded in (False, True))
    return tuple(_passed(aircraft, some, online) for some in alike if some)


def online_estimates(passes: Sequence[EstimatorState]) -> dict[str, OnlineEstimate]:
    """The derivatives by the online estimator; none where it finds no solution."""
    found: dict[str, list[OnlineEstimate]] = {}
    for state in passes:
        for name, one in _estimates(state).items():
            found.setdefault(name, []).append(one)
    return {name: _together(several) for name, several in found.items()}


def _passed(aircraft: Aircraft, records: Sequence[FlightRecord], settings: OnlineSettings) -> EstimatorState:
    """The online estimator after flights that are alike in what was recorded of the controls, as if they were one."""
    slowest = max(record.command_interval for record in records)
    state = estimator.init(aircraft, settings, commanded=records[0].commanded, command_interval=slowest)
    begin = 0.0
    for record in records:
        # each flight has its own beginning, and tells whether its thrust is known
        state.inputs.begin, state.inputs.thrust_known = math.nan, None
        interval = record.air_interval or float(np.median(np.diff(record.time)))
        density = np.where(np.isfinite(record["rho"]), record["rho"], aircraft.reference.air_density)
        made = {"air_interval": np.full(len(record), interval), "rho": density}
        names = (*SAMPLE_COLUMNS, *aircraft.control_symbols)
        samples = np.column_stack([made[name] if name in made else record[name] for name in names])
        times = record.time - record.time[0] + begin
        for time, sample in zip(times.tolist(), samples.tolist(), strict=True):
            estimator.update(state, time, sample)
        estimator.interrupt(state)
        begin = float(times[-1]) + APART
    return state


def _estimates(state: EstimatorState) -> dict[str, OnlineEstimate]:
    if state.latest is None:
        return {}
    shares = dict(zip(state.model.equations.structure.coefficients, state.latest.gusts.tolist(), strict=True))
    return {
        name: OnlineEstimate(d.value, d.standard_error, d.statistical_error, d.status, shares[coefficient])
        for name, d in estimate(state).derivatives.items()
        if (coefficient := name.partition("_")[0]) in shares
    }


def _together(several: Sequence[OnlineEstimate]) -> OnlineEstimate:
    """The mean of valid values by their standard errors, and the smallest of these: tolerances are common to all."""
    chosen = [one for one in several if one.valid] or several
    weights = np.array([1.0 / max(one.standard_error, 1e-100) ** 2 for one in chosen])
    value = float(np.average([one.value for one in chosen], weights=weights)) if weights.any() else chosen[0].value
    return OnlineEstimate(
        value,
        min(one.standard_error for one in chosen),
        min(one.statistical_error for one in chosen),
        chosen[0].status,
        max(one.gusts for one in several),
    )
