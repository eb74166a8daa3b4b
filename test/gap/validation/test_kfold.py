"""Parts by the others. Truth: a fit to the other windows alone."""

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.gap.estimation.candidate_fit import unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.predictive_density import cross_validated_evidence, window_groups, with_neighbours
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.validation.kfold import kfold_evidence, steps_without_groups
from sysid_node.sim import Simulator


def test_each_part_is_left_out_of_what_predicts_it(aircraft, plain_model) -> None:
    fit = converged(unfitted([plain_model], nuisances_of(aircraft, plain_model)))
    (steps,) = steps_without_groups(fit)
    _, sigma, _ = fit.stacked
    for group, step in zip(window_groups(plain_model), steps, strict=True):
        kept = np.setdiff1d(np.arange(plain_model.windows.count), with_neighbours(group, plain_model.windows.count))
        J, r = fit.flights[0].slopes[kept].reshape(-1, step.size), fit.flights[0].rows[kept].ravel()
        free = np.linalg.solve(J.T @ J + fit.prior_information, J.T @ r - fit.stacked[0] / sigma**2)
        assert np.abs(step / sigma).max() > 1e-3
        np.testing.assert_allclose(step / sigma, free / sigma, atol=1e-6)


def test_nuisances_may_be_held(aircraft, plain_model) -> None:
    fit = converged(unfitted([plain_model], nuisances_of(aircraft, plain_model)))
    evidence = kfold_evidence(cross_validated_evidence(fit), fit, filed=True)
    own = [i for i, name in enumerate(plain_model.simulator.names) if name.startswith("derivative_error")]
    for point in evidence.flights[0].points:
        fitted = fit.flights[0].point[own]
        np.testing.assert_allclose(point[own], fitted, rtol=0.0, atol=1e-5 * np.ptp(fitted))


def test_sizes_may_be_held(aircraft, plain_model) -> None:
    nuisances = nuisances_of(aircraft, plain_model)
    (scales,) = (c for c in candidates_of(plain_model.simulator, [plain_model]) if c.label == "imu_scale")
    fit = converged(with_candidates(unfitted([plain_model], nuisances), [scales], nuisances, [0.0] * 6))
    held, moved = list(fit.indices[:2]), list(fit.indices[2:])
    evidence = kfold_evidence(cross_validated_evidence(fit), fit, held=held)
    for point in evidence.flights[0].points:
        np.testing.assert_allclose(point[held], fit.values[:2], rtol=1e-4)
        assert (point[moved] != fit.values[2:]).any()


def test_an_onset_stays_where_the_whole_flight_has_it(aircraft) -> None:
    """Without the parts about it, nothing tells of it; a linear step would lead anywhere."""
    lost = {"control_effectiveness_loss": {"elevator": 0.5, "onset": 12.0}}
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, lost, seed=22, turbulence="light"))
    nuisances = nuisances_of(aircraft, model)
    (loss,) = (
        c for c in candidates_of(model.simulator, [model]) if c.label == "control_effectiveness_loss of elevator"
    )
    fit = converged(with_candidates(converged(unfitted([model], nuisances)), [loss], nuisances, [0.5, 12.0]))
    _, onset = loss.indices
    evidence = kfold_evidence(cross_validated_evidence(fit), fit)
    assert [point[onset] for point in evidence.flights[0].points] == pytest.approx(
        [fit.flights[0].point[onset]] * len(evidence.flights[0].points), abs=0.01
    )
    bare = converged(unfitted([model], nuisances))
    left, without = (
        np.abs(e.flights[0].residual[:, 1:]).max()
        for e in (evidence, kfold_evidence(cross_validated_evidence(bare), bare))
    )
    assert left < 2.0 * without
