"""Whether the interval of the gap's shrinkage holds.

    python -m bench.gap.shrinkage_interval [--flights 20] [--page docs/results/gap_effects.md]

Flights of cdrw with one effect and derivatives off by half their tolerances: one is fitted with that effect, the other
held out. What could be closed on it is known here: the file's error less that of the simulator with everything right.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.align import flight_record
from sysid_node.gap.estimation.candidate_fit import CandidateFit, unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import HeldOutFlight, nuisances_of
from sysid_node.gap.estimation.predictive_density import Evidence, FlightEvidence, held_out_evidence
from sysid_node.gap.flightdata.gap_flight import ANALYSIS_RATE, GapFlight, completed_flights
from sysid_node.gap.instruments.liml import liml_estimate
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.validation.simulation_error import simulation_gap
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie

Effects = Mapping[str, Mapping[str, float]]

EFFECTS: tuple[Effects, ...] = (
    {"actuator_lag": {"time_constant": 0.09}},
    {"command_delay": {"delay": 0.07}},
    {"cg_shift": {"x": 0.05}},
    {"airspeed_scale": {"error": 0.12}},
    {"mass_error": {"error": 0.25}},
)

_STEPS = (
    "3211:elevator:amplitude=0.06:width=0.3:start=1:every=12:repeat=3",
    "3211:aileron:amplitude=0.06:width=0.25:start=5:every=12:repeat=3",
    "3211:rudder:amplitude=0.12:width=0.3:start=9:every=12:repeat=3",
)
_IMU_RATE, _DURATION = 100.0, 42.0


@dataclass(frozen=True)
class Outcome:
    """One pair of flights: shares of the motion, and percent of what could be closed."""

    before: float
    after: float
    foreseen: float  # the noise floor as it is stated
    floor: float  # what the simulator leaves with everything right
    interval: tuple[float, float]

    @property
    def closed(self) -> float:
        """Percent of what could be closed that was; all of it where even the truth leaves more, by chance."""
        return 100.0 * min((self.before - self.after) / (self.before - self.floor), 1.0)

    @property
    def covered(self) -> bool:
        """Whether the interval holds it."""
        low, high = self.interval
        return low <= self.closed <= high


def fly(aircraft: Aircraft, effects: Effects, seed: int, turbulence: str) -> GapFlight:
    """A flight as a bag would hold it."""
    simulator = Simulator(aircraft, _IMU_RATE)
    plan = parse_manoeuvre(list(_STEPS), aircraft, _IMU_RATE, _DURATION)
    deflections = np.zeros((round(_DURATION * _IMU_RATE) + 1, len(simulator.commands)))
    deflections[:, :-1] = plan.surfaces()
    sortie = fly_sortie(simulator, deflections, SortieConditions(effects, turbulence=turbulence, seed=seed))
    record = flight_record(aircraft, FlightSampler(_IMU_RATE, 100.0, 100.0).record(sortie), 0.2)
    [whole] = completed_flights(aircraft, GapFlight(record, _IMU_RATE, 100.0, 100.0, source=f"flight {seed}"))
    return whole


def fitted(model: ResidualModel, effect: str) -> tuple[CandidateFit, CandidateFit]:
    """Derivatives within their tolerances, and the effect with them."""
    nuisances = nuisances_of(model.simulator.aircraft, model)
    base = converged(unfitted([model], nuisances))
    candidate = next(c for c in candidates_of(model.simulator, [model]) if c.effect == effect)
    starts = (converged(with_candidates(base, [candidate], nuisances, start), rounds=1) for start in candidate.starts)
    return liml_estimate(base), liml_estimate(converged(min(starts, key=lambda fit: fit.cost)))


def outcome(aircraft: Aircraft, case: int, turbulence: str) -> Outcome:
    """Of one pair of flights."""
    random, simulator = np.random.default_rng(case), Simulator(aircraft, ANALYSIS_RATE)
    known = {n: d.tolerance for n, d in aircraft.derivatives.items() if d.tolerance}
    wrong = {n: 0.5 * tolerance * float(random.standard_normal()) for n, tolerance in known.items()}
    effects = EFFECTS[case % len(EFFECTS)]
    truth = {**effects, "derivative_error": wrong}
    first, second = (residual_model_of(simulator, fly(aircraft, truth, 2 * case + k, turbulence)) for k in (0, 1))
    held_out = [HeldOutFlight(second, nuisances_of(aircraft, second))]
    base, final = (held_out_evidence(fit, held_out) for fit in fitted(first, next(iter(effects))))
    right = Evidence(np.zeros(0), (FlightEvidence.throughout(second, simulator.vector(truth)),))
    stated, best = simulation_gap(base, final), simulation_gap(base, right)
    assert stated is not None and best is not None
    return Outcome(stated.before, stated.after, stated.noise_floor, best.after, stated.ci95)


def section(flights: int) -> str:
    """The table of both kinds of air."""
    aircraft, rows = load_aircraft("cdrw"), []
    for turbulence in ("none", "light"):
        found = [outcome(aircraft, case, turbulence) for case in range(flights)]
        medians = (np.median([getattr(o, name) for o in found]) for name in ("before", "after", "foreseen", "floor"))
        wide = np.median([o.interval[1] - o.interval[0] for o in found])
        missed = [f"{o.closed:.1f} ({o.interval[0]:.1f} to {o.interval[1]:.1f})" for o in found if not o.covered]
        held = f"{sum(o.covered for o in found)} of {flights}"
        rows.append([turbulence, *(f"{m:.3f}" for m in medians), held, f"{wide:.1f}", "; ".join(missed)])
    sizes = ("before", "after", "noise floor as stated", "with everything right")
    heads = ("turbulence", *sizes, "interval holds the truth", "its width, points", "missed: truth, % (interval)")
    return table(heads, rows)


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=20, help="pairs of flights in each kind of air")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    publish("bench/gap/shrinkage_interval.py", section(args.flights), args.page)


if __name__ == "__main__":
    main()
