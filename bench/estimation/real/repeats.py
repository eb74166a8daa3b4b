"""Whether two flights of one aircraft agree within the errors that they state: chi-square of the differences.

By the statistical errors alone, and by all. What is taken as known is off by the same amount in both flights, so the
total error of a difference is that of J1 (k - k1) - J2 (k - k2): the imperfections k have one prior, and each flight's
estimate of them, k1 or k2, its own noise. With the covariances P1 and P2 and the prior's S, cov(k - k1, k - k2) is
P1 S^-1 P2. Derivatives that are valid in both flights are compared, coefficient by coefficient.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from bench.estimation.real import aircraft, attas, cessna, hfb320, thor
from bench.estimation.real.dimensional import Array, Frequencies
from bench.estimation.real.ordinary import Known, estimated, ordinary, part
from bench.pages import table
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import FlightRecord

HFB_PULSE = 22.0  # s: between the 3-2-1-1 and the pulse
THOR_HALF = 82.0  # s
METHOD = "sls_rft"  # the references' method; by instrumental variables hardly anything is valid in both flights
RUDDER_EARLIER = 0.04  # s: one sample of the ATTAS


class Pair(NamedTuple):
    """Two flights of one aircraft, and what their surfaces' columns carry."""

    name: str
    flights: tuple[FlightRecord, FlightRecord]
    known: tuple[Aircraft, Aircraft]
    carried: str = "auto"
    frequencies: Frequencies | None = None


def pairs(folder: Path) -> list[Pair]:
    """All that the records hold."""
    runs = attas.flown(folder)
    two = part(runs, 0.0, attas.SECOND_RUN), part(runs, attas.SECOND_RUN, np.inf)
    moved = hfb320.moved(two[0], "dr", RUDDER_EARLIER), hfb320.moved(two[1], "dr", RUDDER_EARLIER)
    hfb, uav = hfb320.flown(folder), thor.flown(folder)
    jet = part(hfb, 0.0, HFB_PULSE), part(hfb, HFB_PULSE, np.inf)
    halves = part(uav, 0.0, THOR_HALF), part(uav, THOR_HALF, np.inf)
    both, one = cessna.flown(folder, "dadr"), cessna.flown(folder, "da")
    known = {name: (getattr(aircraft, name)(folder),) * 2 for name in ("attas", "hfb320", "thor")}
    return [
        Pair("ATTAS: ailerons; rudder", two, known["attas"], frequencies=attas.GRID),
        Pair("ATTAS, rudder 40 ms earlier", moved, known["attas"], "positions", attas.GRID),
        Pair("HFB-320: 3-2-1-1; pulse", jet, known["hfb320"], frequencies=hfb320.GRID),
        Pair("Thor: two halves", halves, known["thor"], "commands"),
        Pair(
            "Cessna: da; da and dr", (one, both), (cessna.known(folder, "da"), cessna.known(folder, "dadr")), "commands"
        ),
    ]


def section(folder: Path) -> str:
    """Of the page."""
    heads = ("flights", "compared", "chi-square, statistical errors", "p", "all errors", "p", "furthest apart, in all")
    return table(heads, [row for pair in pairs(folder) for row in _rows(pair)])


def _rows(pair: Pair) -> list[list[str]]:
    one, other = (
        estimated(flight, ordinary(known), pair.carried, pair.frequencies, METHOD)
        for flight, known in zip(pair.flights, pair.known, strict=True)
    )
    both = [name for name in one.valid if name in other.valid and not name.endswith("_0")]
    rows = []
    for coefficient in dict.fromkeys(name.partition("_")[0] for name in both):
        names = [name for name in both if name.startswith(f"{coefficient}_")]
        rows.append([pair.name, ", ".join(names), *_compared(names, one, other)])
    return rows


def _compared(names: list[str], one: Known, other: Known) -> list[str]:
    """Cells from the chi-squares on."""
    difference = np.array([one.estimates.derivatives[n].value - other.estimates.derivatives[n].value for n in names])
    at, to = ([known.covariance.names.index(n) for n in names] for known in (one, other))
    statistical = one.covariance.statistical[np.ix_(at, at)] + other.covariance.statistical[np.ix_(to, to)]
    total = statistical + _systematic(one, other, at, to)
    cells = []
    for covariance in (statistical, total):
        size = float(difference @ np.linalg.solve(covariance, difference))
        cells += [f"{size:.1f} of {len(names)}", f"{chi2.sf(size, len(names)):.3f}"]
    apart = difference / np.sqrt(total.diagonal())
    worst = int(np.argmax(np.abs(apart)))
    return [*cells, f"{names[worst]} {apart[worst]:+.1f}"]


def _systematic(one: Known, other: Known, at: list[int], to: list[int]) -> Array:
    """The covariance of the difference by what is taken as known."""
    (J1, P1, s1, keys1), (J2, P2, s2, keys2) = one.imperfect, other.imperfect
    G1, G2 = J1[:, at].T, J2[:, to].T
    same = np.array([[float(a == b) for b in keys2] for a in keys1]) / np.outer(s1, s2)
    shared = G1 @ P1 @ same @ P2 @ G2.T
    return np.asarray(G1 @ P1 @ G1.T + G2 @ P2 @ G2.T - shared - shared.T)
