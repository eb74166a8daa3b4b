"""A simulator identified from flights that were recorded in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.aircraft.model import Aircraft, LookupTable
from sysid_node.errors import InputError
from sysid_node.gap.estimation.candidate_fit import CandidateFit, unfitted, with_candidates
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import Nuisances, nuisances_of
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.flightdata.time_scales import analysis_rate
from sysid_node.gap.residuals.admissibility import require_admissible
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.residuals.simulator_error import SimulatorError
from sysid_node.gap.surrogate.curvature import curves, residual_of
from sysid_node.gap.surrogate.estimated_aircraft import estimated_aircraft
from sysid_node.gap.surrogate.first_guess import first_guess, room
from sysid_node.gap.surrogate.quality import simulator_error
from sysid_node.gap.surrogate.simulated_flights import require_simulated, split
from sysid_node.gap.surrogate.stepwise import fit_simulator, resolved
from sysid_node.sim import Simulator

#: Ratio, or its inverse, of identified to given derivatives from which the simulated aircraft is another one.
_OTHER_AIRCRAFT = 2.0

#: Derivatives whose common ratio to the file's is that of forces, and of moments.
_FORCES = ("CL_alpha",)
_MOMENTS = ("Cm_de", "Cl_da", "Cn_dr", "Cl_p", "Cm_q")

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Surrogate:
    """A model that stands for a simulator: an aircraft, and how far it is off the simulator."""

    aircraft: Aircraft
    error: SimulatorError  # on simulated flight held out
    room: Mapping[str, float]  # 1 sigma by which a real derivative may plausibly be off the simulator's
    effects: tuple[str, ...]  # found in the simulator beyond the file, by name
    tables: tuple[LookupTable, ...]  # found in the simulator beyond the file
    fitted_seconds: float
    held_out_seconds: float


def identify_simulator(
    aircraft: Aircraft, simulated: Sequence[GapFlight], real: Sequence[GapFlight], progress: Progress
) -> Surrogate:
    """The surrogate of the simulator in which flights were recorded; ``aircraft`` holds masses and first guesses.

    ``real`` are the flights that will be held against it. Raises InputError where a simulated flight is one of these,
    where there is too little simulated flight or a control hardly moves, and where mass, inertia or geometry are not
    the simulator's.
    """
    require_simulated(simulated, real)
    fitted, held_out = split(aircraft, simulated)
    progress(0.0, "reading the simulated flights as forces and moments")
    guess = first_guess(aircraft, simulated)
    simulator = Simulator(guess, analysis_rate(guess, lateral=any(flight.lateral for flight in simulated)))
    models = [resolved(require_admissible(residual_model_of(simulator, flight))) for flight in fitted]
    others = [resolved(residual_model_of(simulator, flight)) for flight in held_out]
    nuisances = nuisances_of(guess, models[0], (*models, *others))
    fit = fit_simulator(models, nuisances, lambda share, text: progress(0.1 + 0.6 * share, text))
    progress(0.75, "curvature that the simulator's derivatives leave")
    fit = _with_tables(fit, nuisances, others)
    found = estimated_aircraft(aircraft, fit)
    require_same_aircraft(aircraft, found, simulated)
    progress(0.9, "the simulator's model on simulated flight held out")
    known = Simulator(replace(found, noise=guess.noise), simulator.rate)
    error = simulator_error([replace(model, simulator=known) for model in others], aircraft.noise)
    effects = tuple(dict.fromkeys(candidate.effect for candidate in fit.candidates))
    seconds = (sum(flight.record.duration for flight in flights) for flights in (fitted, held_out))
    tables = found.tables[len(aircraft.tables) :]
    return Surrogate(found, error, _room(aircraft, found), effects, tables, *seconds)


def _room(file: Aircraft, found: Aircraft) -> dict[str, float]:
    """The file's tolerances: how far a real derivative may plausibly be off; of others that of a first guess."""
    stated = {name: known.tolerance for name, known in file.derivatives.items() if known.tolerance}
    return {name: stated.get(name) or 0.2 * room(name, known) for name, known in found.derivatives.items()}


def _with_tables(fit: CandidateFit, nuisances: Nuisances, others: Sequence[ResidualModel]) -> CandidateFit:
    """The fit with tables for what it leaves, fitted again; the fit itself where it leaves no curvature."""
    guess, points = fit.simulator.aircraft, [flight.point for flight in fit.flights]
    found = curves(guess, residual_of(fit.models, points), residual_of(others, [_shared(fit)] * len(others)))
    if not found:
        return fit
    tables = (*guess.tables, *(curve.table for curve in found))
    simulator = Simulator(replace(guess, tables=tables), fit.simulator.rate)
    models = [replace(model, simulator=simulator) for model in fit.models]
    start = with_candidates(unfitted(models, nuisances), fit.candidates, nuisances, fit.values.tolist())
    return converged(start)


def _shared(fit: CandidateFit) -> np.ndarray:
    """Parameters (P,) that hold for other flights: what is each flight's own is neutral."""
    point, neutral = fit.flights[0].point.copy(), fit.simulator.neutral()
    own = [i for i, shared in zip(fit.nuisances.indices, fit.nuisances.shared, strict=True) if not shared]
    point[own] = neutral[own]
    return point


def require_same_aircraft(file: Aircraft, found: Aircraft, simulated: Sequence[GapFlight]) -> None:
    """Raises InputError where forces or moments are a multiple of what the file's mass and inertia make of them."""
    sources = ", ".join(flight.source for flight in simulated)
    for what, names, key in (("forces", _FORCES, "mass"), ("moments", _MOMENTS, "inertia")):
        ratios = [
            found.derivatives[n].value / file.derivatives[n].value
            for n in names
            if n in file.derivatives and abs(file.derivatives[n].value) > 3.0 * (file.derivatives[n].tolerance or 0.0)
        ]
        ratio = float(np.median(ratios)) if ratios else 1.0
        if not 1.0 / _OTHER_AIRCRAFT < ratio < _OTHER_AIRCRAFT:
            raise InputError(
                f"--simulated {sources}: by the {key} and geometry of {file.name!r}, the simulated {what} are "
                f"{ratio:.2g} times those of its derivatives; give the file the simulator's own {key} and geometry, or "
                "simulated flights of this aircraft"
            )
