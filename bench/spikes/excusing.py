"""What of an effect three tolerances of the derivatives cannot excuse, from the record alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.spikes.drawing import Case
from bench.spikes.editing import edited, misbelieved
from bench.spikes.records import FLIGHTS, Flight, belief, part, regression
from bench.withheld.mattering import within_tolerances
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]

#: Least ratio of what is left with an effect to what is left without it (rms) from which tolerances do not excuse it:
#: what was put in adds as much power as the record's own errors have.
INEXCUSABLE = float(np.sqrt(2.0))

_COEFFICIENTS = ("CL", "CD", "CY", "Cl", "Cm", "Cn")


def ratio_left(folder: Path, case: Case) -> float:
    """What is left with the effect over what is left without it, rms, of the coefficient with the largest ratio.

    It is left of the coefficients that the aircraft file makes of the record, below 4 Hz, when all derivatives have
    done their best within three tolerances. The surfaces follow the commands as they are known to do in the record.
    """
    flight = FLIGHTS[case.flight]
    aircraft = belief(folder, flight)
    other = misbelieved(aircraft, case.effect, case.values)
    records = [part(folder, flight, span) for span in flight.fitted]
    with_it = sum(_power_left(other, flight, edited(r, case.effect, case.values)) for r in records)
    without = sum(_power_left(aircraft, flight, r) for r in records)
    known = np.asarray(without) > 0.0
    return float(np.sqrt(np.max(np.asarray(with_it)[known] / np.asarray(without)[known])))


def _power_left(aircraft: Aircraft, flight: Flight, record: FlightRecord) -> Array:
    """Sum of squares (6,) by coefficient; zero of a coefficient without derivatives."""
    found, columns = regression(aircraft, flight, record)
    return np.array([_least(aircraft, name, found[:, i], columns) for i, name in enumerate(_COEFFICIENTS)])


def _least(aircraft: Aircraft, coefficient: str, values: Array, columns: dict[str, Array]) -> float:
    known = [(n.partition("_")[2], d) for n, d in aircraft.derivatives.items() if n.partition("_")[0] == coefficient]
    if not known:
        return 0.0
    matrix = np.column_stack([columns[regressor] for regressor, _ in known])
    off = values - matrix @ [derivative.value for _, derivative in known]
    left = within_tolerances(off, matrix, [derivative.tolerance or 1.0 for _, derivative in known])
    return float(left @ left)
