"""The rigid-body model that the measurements allow."""

from made_flight import KESTREL, clean

from sysid_node.batch.models.model_for_flights import model_for_flights
from sysid_node.batch.settings import BatchSettings
from sysid_node.flight.record import FlightRecord


def without(record, *names):
    return FlightRecord(record.time, {n: v for n, v in record.columns.items() if n not in names}, record.name)


def test_the_model_follows_what_was_measured():
    record = clean()
    model, remarks = model_for_flights(KESTREL, [record], BatchSettings())
    assert model.states == ("V", "alpha", "beta", "p", "q", "r", "phi", "theta")
    assert not remarks
    gliding, remarks = model_for_flights(KESTREL, [without(record, "thrust")], BatchSettings())
    assert "V" not in gliding.states
    assert "V" in gliding.inputs
    assert not any(name.startswith("CD") for name in gliding.names)
    assert "thrust was not measured" in remarks[0]
    blind, remarks = model_for_flights(KESTREL, [without(record, "beta")], BatchSettings())
    assert "beta" in blind.states
    assert "beta" not in blind.outputs
    assert "beta not measured: known through the other outputs alone" in remarks
