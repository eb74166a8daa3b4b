"""Recursive least squares on the filtered error."""

import numpy as np
import pytest
from made_flight import KESTREL, KINKS, TRUTH, clean, flight, largest_error

from sysid_node.batch.methods.error_filtering import error_filtering
from sysid_node.batch.methods.recursive_least_squares import recursive_least_squares


@pytest.mark.slow
def test_a_filtered_error_keeps_the_noise_of_differentiation_out():
    """Accelerations of rates are the noisiest of all: the spread over flights tells."""
    spread = {}
    for method in (recursive_least_squares, error_filtering):
        values = [method(KESTREL, [flight(seed)]).values for seed in range(6)]
        spread[method] = np.std([[v[name] / TRUTH[name] for name in ("Cm_q", "Cm_de")] for v in values], axis=0)
    assert (spread[error_filtering] < 1.2 * spread[recursive_least_squares]).all()


def test_clean_flights_give_the_truth():
    assert largest_error(error_filtering(KESTREL, [clean(), clean(turn=-1)])) < KINKS
