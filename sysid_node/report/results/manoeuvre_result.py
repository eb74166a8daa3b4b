"""What ``sysid excite`` finds: a manoeuvre, its predicted flight, and how it was optimised."""

from __future__ import annotations

from dataclasses import dataclass

from sysid_node.aircraft.model import Aircraft
from sysid_node.excite.optimise import FlightEnvelope, Optimum
from sysid_node.excite.prediction import Prediction


@dataclass(frozen=True)
class ManoeuvreResult:
    """A manoeuvre with its predicted flight and standard errors; ``optimum`` where it was optimised."""

    aircraft: Aircraft
    prediction: Prediction
    envelope: FlightEnvelope
    autopilot: bool
    optimum: Optimum | None = None
