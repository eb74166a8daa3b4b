"""Estimates from flights in which a sensor was dead.

Where a reading does not change, the derivatives that are estimated from it are wrong with narrow intervals, and so are
those of regressors that moved at the same time. The residuals of no method show it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.flight.live.unchanging import coefficients_of, unchanging_places
from sysid_node.flight.record import FlightRecord
from sysid_node.online import status


def without_dead_sensors(fit: BatchFit, aircraft: Aircraft, records: Sequence[FlightRecord]) -> BatchFit:
    """The ``fit`` to the ``records``, estimates not valid that depend on a reading that stood still in one of them."""
    places = set[int]().union(*(unchanging_places(aircraft, record) for record in records))
    concerned = coefficients_of(places)
    wrong = [name for name in fit.estimates if concerned is None or name.partition("_")[0] in concerned]
    withheld = {name: fit.estimates[name].invalid(status.WORDS[status.STALE]) for name in wrong}
    return replace(fit, estimates={**fit.estimates, **withheld})
