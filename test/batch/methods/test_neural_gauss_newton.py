"""Derivatives through a network that is trained on the motion."""

import dataclasses

import pytest
from made_flight import KESTREL, KINKS, clean, largest_error

from sysid_node.batch.methods.neural_gauss_newton import neural_gauss_newton
from sysid_node.errors import InputError


def test_a_network_needs_the_attitude():
    record = clean()
    blind = {name: values for name, values in record.columns.items() if name != "theta"}
    with pytest.raises(InputError, match="neural_gauss_newton needs theta, not measured"):
        neural_gauss_newton(KESTREL, [dataclasses.replace(record, columns=blind)])


@pytest.mark.slow
def test_clean_flights_give_the_truth():
    assert largest_error(neural_gauss_newton(KESTREL, [clean(), clean(turn=-1)])) < KINKS
