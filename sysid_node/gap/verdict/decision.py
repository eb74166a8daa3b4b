"""The verdict: from what was accepted, what is left over, and what flight not fitted says of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.fit import CandidateFit
from sysid_node.gap.estimation.nuisances import CLOCKS
from sysid_node.gap.estimation.predictive_density import Evidence
from sysid_node.gap.instruments.excitation import externally_excited
from sysid_node.gap.residuals.admissibility import signal_to_noise
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import power_of
from sysid_node.gap.selection.acceptance import power_left
from sysid_node.gap.selection.causes import Cause
from sysid_node.gap.selection.forward_selection import Attribution
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.gap.validation.holdout import Check


def verdict_of(models: Sequence[ResidualModel], attribution: Attribution, check: Check) -> str:
    """One of gap.json's five words."""
    if max(signal_to_noise(model).max() for model in models) < THRESHOLDS.admission.excitation:
        return "unsupported"
    if check.weather_suffices or not any(externally_excited(model) for model in models):
        return "no_gap" if check.weather_suffices else "unsupported"
    if not attribution.causes:
        return "unknown_effect" if structured(attribution) or wanting(attribution) or far_off(check) else "no_gap"
    if short(check) or check.final.total <= check.base.total or explained(attribution) < THRESHOLDS.verdict.explained:
        return "unknown_effect"
    if unexplained(attribution) or wanting(attribution):
        return "unknown_effect"
    return (
        "explained"
        if all(cause.share >= THRESHOLDS.verdict.told_apart for cause in attribution.causes)
        else "ambiguous"
    )


def structured(attribution: Attribution) -> bool:
    """Whether what is left holds structure that matters."""
    return bool(_structured(attribution).any())


def wanting(attribution: Attribution) -> bool:
    """Whether something is there that the likeliest effect accounts for by most, but not by its own law.

    Not where another took its place: that is what is there.
    """
    return any(cause.evidence.supported_but_misspecified and not cause.replaced for cause in attribution.doubted)


def far_off(check: Check) -> bool:
    """Whether the simulator is further off than chance, noise and weather make it, with nothing found to blame.

    However much of the gap the derivatives close, where surely a tenth of the motion is left beyond the noise.
    """
    gap = check.simulation_gap
    surely = (
        gap is not None
        and gap.intervals["after"][0] ** 2 - gap.intervals["noise_floor"][1] ** 2 > THRESHOLDS.verdict.error**2
    )
    return surely or short(check)


def short(check: Check) -> bool:
    """Whether what was found surely falls short of what could be closed, by more than chance leaves."""
    gap = check.simulation_gap
    return (
        gap is not None
        and gap.after > THRESHOLDS.validation.chance * gap.noise_floor
        and gap.ci95[1] < THRESHOLDS.verdict.closed
    )


def unexplained(attribution: Attribution) -> bool:
    """Whether on some channel structure that matters is left, and more of it than all causes take away there."""
    more = _structure_left(attribution) > sum(cause.power_removed for cause in attribution.causes) / _motion(
        attribution.chosen.evidence
    )
    return bool(np.any(_structured(attribution) & more))


def _structured(attribution: Attribution) -> NDArray[np.bool_]:
    """Channels (12,) on which structure that matters is left."""
    power, noticed = (
        _structure_left(attribution),
        THRESHOLDS.acceptance.noticeable_error**2 + _sampling(attribution.chosen.fit),
    )
    return np.asarray((attribution.structure_left.deviations > THRESHOLDS.verdict.structure) & (power > noticed))


def explained(attribution: Attribution) -> float:
    """Share that the effects take away of what lies above the tolerances and is not noise, all channels together."""
    motion = _motion(attribution.chosen.evidence)
    gone = (power_left(attribution.base.evidence) - power_left(attribution.chosen.evidence)) / motion
    taken = max(float(gone.sum()), 0.0)
    whole = taken + float(_structure_left(attribution).sum())
    return taken / whole if whole > 0.0 else 1.0


def _structure_left(attribution: Attribution) -> Array:
    """Power (12,) of what is left and is structure beyond chance, as shares of the motion."""
    left, evidence = attribution.structure_left, attribution.chosen.evidence
    share = np.where(left.deviations > THRESHOLDS.instruments.chance, left.share, 0.0)
    return np.asarray(share * power_left(evidence) / _motion(evidence))


def _sampling(fit: CandidateFit) -> Array:
    """Power (12,) that stamps leave which are off by chance within a sample, as shares of the motion.

    A step in a command falls anywhere between two messages, each time elsewhere: no clock's error is it, and coherent
    with the commands it is.
    """
    left, motion = np.zeros(len(CHANNELS)), np.zeros(len(CHANNELS))
    for model, point in zip(fit.models, fit.points, strict=True):
        rates = np.array([model.flight.actuator_rate, model.flight.air_rate])
        slopes = model.slopes(point, [model.simulator.names.index(f"{clock}.delay") for clock in CLOCKS])
        left += sum(power_of(slopes[..., i]) / (12.0 * rate**2) for i, rate in enumerate(rates))
        motion += (np.abs(model.measured[:, 1:]) ** 2).sum(axis=(0, 1))
    return left / np.maximum(motion, 1e-300)


def _motion(evidence: Evidence) -> Array:
    """Power (12,) of what was measured, about the windows' means."""
    power = sum((np.abs(v.measured[:, 1:]) ** 2).sum(axis=(0, 1)) for v in evidence.models)
    return np.asarray(np.maximum(power, 1e-300))


def named(cause: Cause) -> list[str]:
    """Effects that are named beside a cause."""
    return [effect for effect, p in cause.alternatives if p > THRESHOLDS.verdict.named]
