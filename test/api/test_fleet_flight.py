"""The work on one flight of a fleet: which part of its errors another flight of the same aircraft shares."""

from pathlib import Path

import numpy as np
import pytest
from made_flights import made_aircraft, made_streams

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.api import identify, load
from sysid_node.api.fleet_flight import estimate_flight
from sysid_node.fleet.outcome import FleetSettings, FlightTask
from sysid_node.flight.bag.writer import write_streams


@pytest.mark.slow
def test_a_batch_methods_systematic_error_is_no_statistical_one(tmp_path: Path) -> None:
    write_streams(tmp_path / "a", made_streams(12.0))
    (tmp_path / "made.yaml").write_text(dump_aircraft(made_aircraft()))
    flight = load(tmp_path / "a", tmp_path / "made.yaml")
    settings = FleetSettings(method="equation_error")
    outcome = estimate_flight(FlightTask("a", str(tmp_path / "a"), flight.aircraft, settings))
    found = identify(flight, "equation_error").derivatives
    rows = [found[name] for name in outcome.names]
    total, statistical = (np.sqrt(c.diagonal()) for c in (outcome.covariance, outcome.statistical_covariance))
    assert total == pytest.approx([row.standard_error for row in rows], rel=1e-6)
    assert statistical == pytest.approx([row.statistical_error for row in rows], rel=1e-6)
    assert all(row.systematic_error > 0.0 for row in rows)
