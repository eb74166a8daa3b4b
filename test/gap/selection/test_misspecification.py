"""A law that is not the right one leaves what goes with it; truth: gyros that read low, and that saturate."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.selection.calibration import calibrated_probability, evidence_of, is_supported_but_misspecified
from sysid_node.gap.selection.candidate_fitter import CandidateFitter
from sysid_node.gap.selection.misspecification import explained_by, misspecification_of
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def evidence_for_gyro_scale(aircraft):
    """What a scale of the IMU leaves of what it does, fitted to a flight."""

    def of(flight):
        model = residual_model_of(Simulator(aircraft, 50.0), flight)
        nuisances = nuisances_of(aircraft, model)
        fitter = CandidateFitter(nuisances, Checkpoint())
        base = fitter.fit_set(unfitted([model], nuisances), [])
        (candidate,) = (c for c in candidates_of(model.simulator, [model]) if c.label == "imu_scale")
        tested = misspecification_of(fitter.add_candidate(base, candidate).fit, candidate)
        return evidence_of("imu_scale", 1000.0, tested, THRESHOLDS.calibration.windows)

    return of


@pytest.mark.slow
@pytest.mark.parametrize("turbulence", ["none", "light"])
def test_a_gyro_that_reads_low_is_one(evidence_for_gyro_scale, make_flight, turbulence) -> None:
    evidence = evidence_for_gyro_scale(make_flight({"imu_scale": {"p": -0.2}}, seed=5, turbulence=turbulence))
    assert evidence.misspecification < 0.2
    assert calibrated_probability(evidence) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("turbulence", ["none", "light"])
def test_a_gyro_that_saturates_is_not_one_that_reads_low(evidence_for_gyro_scale, make_flight, turbulence) -> None:
    flight = make_flight({}, seed=5, turbulence=turbulence)
    rate = flight.record["p"]
    cut = np.clip(rate, -0.4 * np.abs(rate).max(), 0.4 * np.abs(rate).max())
    clipped = replace(flight.record, columns={**flight.record.columns, "p": cut})
    evidence = evidence_for_gyro_scale(replace(flight, record=clipped))
    assert evidence.misspecification > 0.4
    assert is_supported_but_misspecified(evidence)


def test_bursts_that_are_in_remainder_and_regressor_are_chance() -> None:
    """Truth: independent noise that is ten times as strong in one of eight windows, in both alike.

    A remainder of constant power would be explained beyond chance in most draws; counted by windows it is not.
    """
    random = np.random.default_rng(1)
    windows = np.repeat(np.arange(8), 100)
    burst = np.where(windows == 3, 10.0, 1.0)
    counts = []
    for _ in range(200):
        added, remainder = burst[:, None] * random.standard_normal((800, 3)), burst * random.standard_normal(800)
        remainder /= remainder.std()
        found = [explained_by(added, remainder, np.zeros((800, 1)), np.eye(1), each) for each in (None, windows)]
        counts.append([(f.squares - f.mean) / np.sqrt(f.variance) > THRESHOLDS.calibration.deviations for f in found])
    naive, robust = np.mean(counts, axis=0)
    assert naive > 0.3 and robust < 0.05


def test_what_goes_with_the_regressor_throughout_is_explained_whatever_the_bursts() -> None:
    """Truth: a share of the regressor itself in the remainder of every window."""
    random = np.random.default_rng(2)
    windows = np.repeat(np.arange(8), 100)
    added = random.standard_normal((800, 1))
    remainder = random.standard_normal(800) + 0.5 * added[:, 0]
    found = explained_by(added, remainder, np.zeros((800, 1)), np.eye(1), windows)
    assert (found.squares - found.mean) / np.sqrt(found.variance) > 20.0
    assert found.squares - found.mean == pytest.approx(0.25 * 800, rel=0.2)
