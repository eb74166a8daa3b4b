"""The extended Kalman filter against the published run, and against maximum likelihood where the model is linear."""

import pytest
from kalman_cases import assert_near_maximum_likelihood, published_case
from reference_flights import HFB_EKF

from sysid_node.batch.methods.extended_kalman_filter import extended_kalman_filter


@pytest.mark.slow
def test_it_gives_the_published_figures(flights):
    case, noise = published_case(flights)
    final = extended_kalman_filter(case.model, [case.manoeuvre], noise).final
    for name, (value, error) in HFB_EKF.items():
        assert abs(final[name].value - value) < 0.05 * error, name
        if name != "Cm_de":  # its error was not published
            assert final[name].standard_error == pytest.approx(error, rel=0.05), name


def test_it_ends_near_maximum_likelihood():
    assert_near_maximum_likelihood(extended_kalman_filter)
