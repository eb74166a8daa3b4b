"""The whole diagnosis of a gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sysid_node.aircraft.model import Aircraft
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import HeldOutFlight, nuisances_of
from sysid_node.gap.estimation.predictive_density import can_be_divided, transferred_parameters
from sysid_node.gap.flightdata.gap_flight import GapFlight, with_inferred_signals
from sysid_node.gap.flightdata.manoeuvre_window import cut_to_manoeuvre
from sysid_node.gap.flightdata.time_scales import analysis_rate
from sysid_node.gap.residuals.admissibility import require_admissible, require_distinct_flights
from sysid_node.gap.residuals.air_motion import gust_speed
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.residuals.simulator_error import with_simulator_error
from sysid_node.gap.selection.candidate_fitter import Progress
from sysid_node.gap.selection.confusion import Confusion, confusion_of
from sysid_node.gap.selection.forward_selection import Attribution, attribute
from sysid_node.gap.surrogate.identify import Surrogate, identify_simulator
from sysid_node.gap.validation.holdout import Check, validate
from sysid_node.gap.validation.spectral_error import Gap
from sysid_node.gap.verdict import localisation
from sysid_node.gap.verdict.decision import Decision, VerdictScores, decide
from sysid_node.gap.verdict.localisation import BinnedCoefficient
from sysid_node.gap.verdict.measurement import measure
from sysid_node.gap.verdict.next_flight import advice
from sysid_node.sim import Simulator


@dataclass(frozen=True)
class Diagnosis:
    """The result of a diagnosis: the decision, what it was made from, and what is reported beside it."""

    aircraft: Aircraft
    decision: Decision
    scores: VerdictScores  # from which the verdict was decided
    attribution: Attribution
    check: Check  # on flight not fitted
    held_out: bool  # whether that is a flight of its own; else parts of the same flights
    where: list[dict[str, Any]]
    shape: BinnedCoefficient | None
    confusion: Confusion
    next_flight: str
    air_motion: float  # rms of the air's motion across the flight path, m/s
    surrogate: Surrogate | None = None  # the model of the user's simulator, where it was identified from its flights

    @property
    def verdict(self) -> str:
        """One of the five words of gap.json."""
        return self.decision.verdict

    @property
    def models(self) -> tuple[ResidualModel, ...]:
        """The flights on which the gap is measured."""
        return self.check.models

    @property
    def measured_on(self) -> str:
        """On what the gap is measured: flights ``held_out``, ``parts`` that were not fitted, or what was ``fitted``."""
        if self.held_out:
            return "held_out"
        return "parts" if can_be_divided(self.models) else "fitted"

    @property
    def gap(self) -> Gap:
        """The gap of forces, moments and kinematics by frequency."""
        return self.check.stated[0]

    @property
    def simulation_gap(self) -> Gap | None:
        """The gap of short simulated flights; none where none can be simulated."""
        return self.check.stated[1]

    @property
    def size(self) -> Gap:
        """The gap that is reported first: of short flights, or of forces and kinematics where there are none."""
        return self.simulation_gap or self.gap


def diagnose(
    aircraft: Aircraft,
    flights: Sequence[GapFlight],
    holdouts: Sequence[GapFlight],
    progress: Progress = lambda s, t: None,
    keep: Path | None = None,
    simulated: Sequence[GapFlight] = (),
) -> Diagnosis:
    """The diagnosis of flights; the gap is measured on flights held out, or without these on parts of the same flights.

    ``simulated`` are flights recorded in the user's own simulator. It is identified from them first, and the flights
    are held against that model (``surrogate``); the aircraft then gives geometry, mass and first guesses.

    A single flight with a single manoeuvre is cut down to it (``manoeuvre_window``). ``keep`` is a folder for finished
    fits, from which an interrupted diagnosis goes on; its files are removed at the end. Raises InputError for an
    aircraft file without tolerances or of another aircraft, for a held-out flight that is also fitted, and for a flight
    in which no control surface moves.
    """
    require_distinct_flights(flights, holdouts)
    if not simulated:
        return _diagnosis(aircraft, flights, holdouts, progress, keep)
    real = (*flights, *holdouts)
    surrogate = identify_simulator(aircraft, simulated, real, lambda s, t: progress(0.4 * s, t))
    later: Progress = lambda s, t: progress(0.4 + 0.6 * s, t)  # noqa: E731
    flights, holdouts = ([with_inferred_signals(surrogate.aircraft, f) for f in group] for group in (flights, holdouts))
    return _diagnosis(surrogate.aircraft, flights, holdouts, later, keep, surrogate)


def _diagnosis(
    aircraft: Aircraft,
    flights: Sequence[GapFlight],
    holdouts: Sequence[GapFlight],
    progress: Progress,
    keep: Path | None,
    surrogate: Surrogate | None = None,
) -> Diagnosis:
    """The diagnosis of flights held against an aircraft, which stands for a simulator where it is a surrogate."""
    progress(0.0, "reading the flights as forces and moments")
    if len(flights) == 1 and not holdouts:
        flights = [cut_to_manoeuvre(flights[0], aircraft.control_symbols)]
    lateral = any(flight.lateral for flight in (*flights, *holdouts))
    simulator = Simulator(aircraft, analysis_rate(aircraft, lateral=lateral))
    models, others = ([_model_of(simulator, flight, surrogate) for flight in group] for group in (flights, holdouts))
    room = surrogate.room if surrogate else {}
    every = (*models, *others)
    nuisances = nuisances_of(aircraft, models[0], every, room, fitted_with=models[1:])
    theirs = [nuisances_of(aircraft, model, every, room) for model in others]
    held_out = [HeldOutFlight(*parts) for parts in zip(others, theirs, strict=True)]
    checkpoint = Checkpoint.of(keep, models)
    attribution = attribute(models, nuisances, lambda s, t: progress(0.05 + 0.85 * s, t), checkpoint, held_out)
    progress(0.92, "the gap on flight not fitted")
    attribution, checked = validate(attribution, models, held_out)
    scores = measure(models, attribution, checked)
    decision = decide(scores)
    progress(0.95, "short flights beside the flight, and what to fly next")
    found = localisation.where(attribution)
    air = max(gust_speed(v, transferred_parameters(attribution.corrected, v)) for v in (*models, *others))
    flight = advice(decision.verdict, attribution)
    checkpoint.clear()
    return Diagnosis(
        aircraft, decision, scores, attribution, checked, bool(holdouts), found, localisation.missing(attribution),
        confusion_of(attribution.base, attribution.first_stage), flight, air, surrogate,
    )  # fmt: skip


def _model_of(simulator: Simulator, flight: GapFlight, surrogate: Surrogate | None) -> ResidualModel:
    """The residual model of a flight, with what the surrogate leaves of the simulator that it stands for."""
    model = require_admissible(residual_model_of(simulator, flight, will_be_fitted=True))
    return with_simulator_error(model, surrogate.error) if surrogate else model
