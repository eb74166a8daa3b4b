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
from sysid_node.gap.selection.misspecification import misspecification_of
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import Simulator


@pytest.fixture(scope="module")
def misfit(aircraft):
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


@pytest.mark.parametrize("turbulence", ["none", "light"])
def test_a_gyro_that_reads_low_is_one(misfit, make_flight, turbulence) -> None:
    evidence = misfit(make_flight({"imu_scale": {"p": -0.2}}, seed=5, turbulence=turbulence))
    assert evidence.misfit < 0.2
    assert calibrated_probability(evidence) > 0.9


@pytest.mark.parametrize("turbulence", ["none", "light"])
def test_a_gyro_that_saturates_is_not_one_that_reads_low(misfit, make_flight, turbulence) -> None:
    flight = make_flight({}, seed=5, turbulence=turbulence)
    rate = flight.record["p"]
    cut = np.clip(rate, -0.4 * np.abs(rate).max(), 0.4 * np.abs(rate).max())
    clipped = replace(flight.record, columns={**flight.record.columns, "p": cut})
    evidence = misfit(replace(flight, record=clipped))
    assert evidence.misfit > 0.4
    assert is_supported_but_misspecified(evidence)
