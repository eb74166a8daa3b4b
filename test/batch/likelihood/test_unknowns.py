"""The vector of unknowns: its layout, its bounds and priors, and the names that it refuses."""

import numpy as np
import pytest
from made_models import SHORT_PERIOD, flown, short_period_model

from sysid_node.batch.likelihood.unknowns import Unknowns
from sysid_node.batch.models.model import ModelParameter
from sysid_node.errors import InputError


def two_manoeuvres(**parameter):
    model = short_period_model(**parameter)
    manoeuvres = [flown(model, initial=(0.1, 0.2)), flown(model, initial=(0.3, 0.4))]
    return Unknowns.of(model, manoeuvres, ("q",), ("az", "alpha"))


def test_parameters_come_first_then_each_manoeuvres_initial_states_and_biases():
    unknowns = two_manoeuvres()
    assert unknowns.size == 5 + 2 * 3
    np.testing.assert_array_equal(unknowns.start(), [*SHORT_PERIOD.values(), 0.2, 0.0, 0.0, 0.4, 0.0, 0.0])
    z = np.arange(11.0)
    np.testing.assert_array_equal(unknowns.theta(z), z[:5])
    np.testing.assert_array_equal(unknowns.initial_state(z, 0), [0.1, 5.0])
    np.testing.assert_array_equal(unknowns.initial_state(z, 1), [0.3, 8.0])
    np.testing.assert_array_equal(unknowns.bias(z, 1), [10.0, 0.0, 9.0])  # alpha, q, az
    assert unknowns.nuisance(z)[0] == {"q(0)": 5.0, "bias_az": 6.0, "bias_alpha": 7.0}


def test_only_parameters_have_bounds_and_priors():
    unknowns = two_manoeuvres(lower=-100.0, upper=0.0)
    lower, upper = unknowns.bounds()
    assert (lower[:5] == -100.0).all()
    assert (upper[:5] == 0.0).all()
    assert np.isinf(lower[5:]).all()
    parameters = tuple(
        ModelParameter(name, value, prior=(value, 2.0) if name == "Mq" else None, fixed=name == "Za")
        for name, value in SHORT_PERIOD.items()
    )
    index, mean, sigma = Unknowns.of(
        short_period_model().changed(parameters=parameters), [flown(short_period_model())], (), ()
    ).priors()
    assert index.tolist() == [2]  # Zd, Ma, Mq: the fixed parameter is none of the unknowns
    assert (mean.tolist(), sigma.tolist()) == ([SHORT_PERIOD["Mq"]], [2.0])


def test_unknown_names_and_nothing_to_estimate_are_refused():
    model = short_period_model()
    with pytest.raises(InputError, match="has no state 'theta'; known: alpha, q"):
        Unknowns.of(model, [flown(model)], ("theta",), ())
    with pytest.raises(InputError, match="no output 'V'"):
        Unknowns.of(model, [flown(model)], (), ("V",))
    with pytest.raises(InputError, match="every parameter is fixed"):
        Unknowns.of(model.fixed(), [flown(model)], (), ())
