"""The whole diagnosis of a gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sysid_node.aircraft.model import Aircraft
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.predictive_density import Evidence, transferred_parameters
from sysid_node.gap.flightdata.gap_flight import ANALYSIS_RATE, GapFlight
from sysid_node.gap.flightdata.manoeuvre_window import cut_to_manoeuvre
from sysid_node.gap.residuals.admissibility import require_admissible, require_distinct_flights
from sysid_node.gap.residuals.air_motion import gust_speed
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.selection.candidate_fitter import Progress
from sysid_node.gap.selection.confusion import Confusion, confusion_of
from sysid_node.gap.selection.forward_selection import Attribution, attribute
from sysid_node.gap.validation.holdout import validate
from sysid_node.gap.validation.spectral_error import Gap
from sysid_node.gap.verdict import localisation
from sysid_node.gap.verdict.decision import verdict_of
from sysid_node.gap.verdict.localisation import Shape
from sysid_node.gap.verdict.next_flight import advice
from sysid_node.sim import Simulator


@dataclass(frozen=True)
class Diagnosis:
    """What was found. ``models`` are the flights on which the gap is measured, with the evidence there."""

    aircraft: Aircraft
    verdict: str
    gap: Gap  # of forces, moments and kinematics by frequency
    simulation_gap: Gap | None  # of short flights
    where: list[dict[str, Any]]
    attribution: Attribution
    shape: Shape | None
    models: tuple[ResidualModel, ...]
    base: Evidence
    final: Evidence
    next_flight: str
    held_out: bool
    confusion: Confusion
    air_motion: float  # rms of the air's motion across the flight path, m/s

    @property
    def size(self) -> Gap:
        """The gap as it is told: of short flights, of forces and kinematics where the flight shows none."""
        return self.simulation_gap or self.gap


def diagnose(
    aircraft: Aircraft,
    flights: Sequence[GapFlight],
    holdouts: Sequence[GapFlight],
    progress: Progress = lambda s, t: None,
    keep: Path | None = None,
) -> Diagnosis:
    """Diagnoses flights, and measures the gap on flights held out; without these, by parts of the same flights.

    One flight alone with one manoeuvre is cut down to it (``quiet``). ``keep``: a folder for finished steps, from which
    an interrupted diagnosis goes on; empty again at the end.
    Raises InputError: an aircraft file without tolerances or of another aircraft, a held-out flight that is also
    fitted, a flight in which nothing moves.
    """
    require_distinct_flights(flights, holdouts)
    progress(0.0, "reading the flights as forces and moments")
    if len(flights) == 1 and not holdouts:
        flights = [cut_to_manoeuvre(flights[0], aircraft.control_symbols)]
    simulator = Simulator(aircraft, ANALYSIS_RATE)
    models = [require_admissible(residual_model_of(simulator, flight)) for flight in flights]
    unseen = [require_admissible(residual_model_of(simulator, flight)) for flight in holdouts]
    nuisances, *own = (nuisances_of(aircraft, model, (*models, *unseen)) for model in (models[0], *unseen))
    steps = Checkpoint.of(keep, models)
    attribution = attribute(models, nuisances, lambda s, t: progress(0.05 + 0.85 * s, t), steps, unseen, own)
    progress(0.92, "the gap on flight not fitted")
    attribution, checked = validate(attribution, models, unseen, own)
    verdict = verdict_of(models, attribution, checked)
    progress(0.95, "short flights beside the flight, and what to fly next")
    found = localisation.where(attribution, [v.residual(simulator.neutral()) for v in models])
    air = max(gust_speed(v, transferred_parameters(attribution.corrected, v)) for v in (*models, *unseen))
    flight = advice(verdict, attribution)
    steps.forget()
    return Diagnosis(
        aircraft, verdict, checked.gap, checked.simulation_gap, found, attribution,
        localisation.missing(attribution), checked.models, checked.base, checked.final, flight, bool(holdouts),
        confusion_of(attribution.base, attribution.first_stage), air,
    )  # fmt: skip
