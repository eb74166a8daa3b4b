"""From the state file to ``FleetResults``: the outcomes of the flights that the catalogue names, and the refusals."""

from __future__ import annotations

from dataclasses import replace

from sysid_node.fleet.catalogue.catalogue import CatalogueFlight
from sysid_node.fleet.plan import Plan
from sysid_node.fleet.results import FleetResults, FlightResult, Refusal
from sysid_node.fleet.state.store import FleetState, FlightEntry

NO_DATE = "the catalogue gives no date and the log's clock says none; write its date into the catalogue"
NO_TAIL = "the catalogue gives no tail and the log names no vehicle; write its tail into the catalogue"
NOT_RUN = "was not worked on yet; start the command again"


def assembled(plan: Plan, state: FleetState) -> FleetResults:
    """The results of the catalogue's flights, as far as they are finished, sorted by tail and date.

    The catalogue's tail, date and configuration count; where it has none, the log's, and then the tail's folder.
    """
    entries = {entry.flight: entry for entry in state.entries()}
    flights, refusals = [], []
    for flight in plan.catalogue.flights:
        found = _result(plan, flight, entries.get(flight.flight))
        if isinstance(found, FlightResult):
            flights.append(found)
        else:
            refusals.append(found)
    flights.sort(key=lambda one: (one.tail, one.date, one.flight))
    notes = tuple(replace(note, aircraft=plan.type_of(note.aircraft)) for note in plan.catalogue.maintenance)
    return FleetResults(tuple(flights), tuple(refusals), notes)


def _result(plan: Plan, flight: CatalogueFlight, entry: FlightEntry | None) -> FlightResult | Refusal:
    outcome = entry.outcome if entry is not None else None
    tail = flight.tail or (outcome.vehicle if outcome is not None else "") or flight.fallback_tail
    date = flight.date or (outcome.date if outcome is not None else None)
    aircraft = plan.aircraft_of(flight)
    name = aircraft.name if aircraft is not None else flight.aircraft
    reason = plan.fault_of(flight) or (entry.reason if entry is not None else NOT_RUN)
    if not reason and (not tail or date is None):
        reason = f"{flight.flight}: {NO_DATE if tail else NO_TAIL}"
    if reason or outcome is None or entry is None or date is None:
        return Refusal(flight.flight, name, tail, date, reason)
    return FlightResult(
        flight=flight.flight,
        aircraft=name,
        tail=tail,
        configuration=flight.configuration,
        date=date,
        data_seconds=outcome.data_seconds,
        names=outcome.names,
        values=outcome.values,
        covariance=outcome.covariance,
        statistical_covariance=outcome.statistical_covariance,
        valid=outcome.valid,
        gap=entry.gap,
        report=entry.report,
        remarks=entry.remarks,
    )
