"""Real records estimated as a user's would be: by an aircraft file that has tolerances, not one that is ideal."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.estimation.real.dimensional import Frequencies
from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.flight.record import FlightRecord
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.estimates.covariance import EstimateCovariance, estimate_covariance
from sysid_node.online.replay import run_to_end
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.systematic.imperfections import prior
from sysid_node.online.types import Estimates

Array = NDArray[np.float64]


class Imperfect(NamedTuple):
    """What K imperfections do to D derivatives, and how well they are known before and after the flight."""

    jacobian: Array  # (K, D)
    covariance: Array  # (K, K) after it
    tolerances: Array  # (K,) 1 sigma before it
    keys: list[str]  # (K,) which they are


class Known(NamedTuple):
    """Estimates at a record's end."""

    estimates: Estimates
    covariance: EstimateCovariance
    imperfect: Imperfect

    @property
    def valid(self) -> list[str]:
        """Names of the derivatives that are valid."""
        return [name for name, d in self.estimates.derivatives.items() if d.valid]


def ordinary(aircraft: Aircraft, servos: Mapping[str, float] | None = None) -> Aircraft:
    """The file of an aircraft with default tolerances; ``servos``: time constants (s) that it states, by control."""
    text = dump_aircraft(replace(aircraft, ideal=False))
    if servos:
        stated = ", ".join(f"{name}: {seconds:g}" for name, seconds in servos.items())
        text += f"\neffects:\n  actuator_lag: {{{stated}}}\n"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "aircraft.yaml"
        file.write_text(text, encoding="utf-8")
        return load_aircraft(str(file))


def estimated(
    flight: FlightRecord,
    aircraft: Aircraft,
    carried: str,
    frequencies: Frequencies | None = None,
    method: str = "iv_rft",
) -> Known:
    """What a replay finds at the record's end; the ``aircraft`` must have tolerances."""
    settings = OnlineSettings(actuators=carried, settle_time=0.0, method=method)
    if frequencies is not None:
        settings = replace(settings, frequencies=frequencies)
    aligned = align_streams(aircraft, streams_from_record(flight, aircraft), settings.max_gap, carried)
    due = aligned.time[-1:]
    history, state = run_to_end(
        aircraft, settings, aligned.time, aligned.samples, due, commands_from=aligned.commands_from
    )
    covariance, latest, imperfections = estimate_covariance(state), state.latest, state.model.imperfections
    if covariance is None or latest is None or latest.systematic is None or imperfections is None:
        raise SystemExit(f"{flight.name}: nothing was estimated, or the aircraft file has no tolerances")
    considered = latest.systematic.considered
    jacobian = considered.jacobian.reshape(considered.jacobian.shape[0], -1)[:, state.model.table.place]
    tolerances, _, _ = prior(imperfections, latest.systematic.lines)
    # a servo has its key twice: for its lateness and its curvature
    keys = [f"{key} {imperfections.keys[:i].count(key)}" for i, key in enumerate(imperfections.keys)]
    return Known(history[-1], covariance, Imperfect(jacobian, considered.covariance, tolerances, keys))


def part(flight: FlightRecord, begin: float, end: float) -> FlightRecord:
    """The samples from ``begin`` to ``end`` (s)."""
    kept = slice(*np.searchsorted(flight.time, [begin, end]).tolist())
    return replace(flight, time=flight.time[kept], columns={name: x[kept] for name, x in flight.columns.items()})


def apart(flight: FlightRecord, at: float, by: float = 20.0) -> FlightRecord:
    """Two runs that were joined at a time (s), with ``by`` s between them."""
    return replace(flight, time=flight.time + by * (flight.time >= at))
