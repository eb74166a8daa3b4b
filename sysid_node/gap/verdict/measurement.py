"""The table of scores that the verdict depends on, measured from flights, selection and validation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.nuisances import CLOCKS
from sysid_node.gap.estimation.predictive_density import Evidence
from sysid_node.gap.instruments.excitation import externally_excited
from sysid_node.gap.residuals.admissibility import signal_to_noise
from sysid_node.gap.residuals.excited_axes import excited_channels
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import power_of
from sysid_node.gap.selection.calibration import is_supported_but_misspecified
from sysid_node.gap.selection.comparison import power_left
from sysid_node.gap.selection.forward_selection import Attribution
from sysid_node.gap.validation.holdout import Check
from sysid_node.gap.validation.spectral_error import Gap
from sysid_node.gap.verdict.decision import CauseScores, RejectedCauseScores, SimulationScores, VerdictScores


def measure(models: Sequence[ResidualModel], attribution: Attribution, check: Check) -> VerdictScores:
    """The table of an explanation (``selection``) that was validated on flight not fitted (``validation``).

    ``models`` are the flights that were fitted.
    """
    evidence, structure = attribution.chosen.evidence, attribution.structure_left
    return VerdictScores(
        signal_to_noise=float(max(signal_to_noise(model).max() for model in models)),
        weather_suffices=check.weather_suffices,
        externally_excited=any(externally_excited(model) for model in models),
        causes=tuple(CauseScores(c.candidate.label, c.share, c.power_removed) for c in attribution.causes),
        rejected=tuple(
            RejectedCauseScores(c.candidate.label, is_supported_but_misspecified(c.evidence), c.replaced)
            for c in attribution.rejected
        ),
        score_before=check.base.total,
        score_after=check.final.total,
        motion=_motion(evidence),
        power_before=power_left(attribution.base.evidence),
        power_after=power_left(evidence),
        structure_deviations=structure.deviations,
        structure_share=structure.share,
        sampling=sampling_power(attribution.chosen.fit) + surrogate_error(models) ** 2,
        simulation=_simulation_scores(check.simulation_gap),
        excited=excited_channels(check.models).astype(float),
    )


def surrogate_error(models: Sequence[ResidualModel]) -> Array:
    """Error (12,) of the simulator's model, as a share of the motion; zero where the simulator itself is known."""
    return np.asarray(np.max([model.simulator_error for model in models], axis=0))


def _simulation_scores(gap: Gap | None) -> SimulationScores | None:
    """What the verdict depends on of the gap of short flights."""
    if gap is None:
        return None
    intervals = gap.intervals
    return SimulationScores(gap.after, gap.noise_floor, intervals["after"][0], intervals["noise_floor"][1], gap.ci95[1])


def sampling_power(fit: CandidateFit) -> Array:
    """Power (12,) that stamps leave which are off by chance within a sample, as a share of the motion.

    A step in a command falls anywhere between two messages, uniformly, so that the stamp's variance is 1/12 of the
    squared sample period. This is no clock error, although it is coherent with the commands.
    """
    left, motion = np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS))
    for fitted in fit.flights:
        model, point = fitted.model, fitted.point
        intervals = model.flight.step_interval, 1.0 / model.flight.air_rate
        slopes = model.slopes(point, [model.simulator.names.index(f"{clock}.delay") for clock in CLOCKS])
        left += sum(power_of(slopes[..., i]) * interval**2 / 12.0 for i, interval in enumerate(intervals))
        motion += model.motion_power
    return left / np.maximum(motion, 1e-300)


def _motion(evidence: Evidence) -> Array:
    """Power (12,) of what was measured, about the windows' means."""
    power = sum(flight.model.motion_power for flight in evidence.flights)
    return np.asarray(np.maximum(power, 1e-300))
