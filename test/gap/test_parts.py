"""Parts by the others. Truth: a fit to the other windows alone."""

import numpy as np

from sysid_node.gap.evidence import beside, cross_validated, groups_of
from sysid_node.gap.fit import blank, polish
from sysid_node.gap.nuisance import nuisances_of
from sysid_node.gap.parts import _steps, parted


def test_each_part_is_left_out_of_what_predicts_it(aircraft, plain_view) -> None:
    fit = polish(blank([plain_view], nuisances_of(aircraft, plain_view)))
    (steps,) = _steps(fit, filed=False)
    _, sigma, _ = fit.stacked
    for group, step in zip(groups_of(plain_view), steps, strict=True):
        kept = np.setdiff1d(np.arange(plain_view.windows.count), beside(group, plain_view.windows.count))
        J, r = fit.slopes[0][kept].reshape(-1, step.size), fit.rows[0][kept].ravel()
        free = np.linalg.solve(J.T @ J + fit.prior_information, J.T @ r - fit.stacked[0] / sigma**2)
        assert np.abs(step / sigma).max() > 1e-3
        np.testing.assert_allclose(step / sigma, free / sigma, atol=1e-6)


def test_nuisances_may_be_held(aircraft, plain_view) -> None:
    fit = polish(blank([plain_view], nuisances_of(aircraft, plain_view)))
    evidence = parted(cross_validated(fit), fit, filed=True)
    own = [i for i, name in enumerate(plain_view.simulator.names) if name.startswith("derivative_error")]
    for point in evidence.points[0]:
        np.testing.assert_allclose(point[own], fit.points[0][own], rtol=0.0, atol=1e-5 * np.ptp(fit.points[0][own]))
