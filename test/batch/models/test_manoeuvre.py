"""A manoeuvre's data, and whether they fit a model."""

import dataclasses

import numpy as np
import pytest
from made_models import flown, short_period_model, with_outputs

from sysid_node.batch.models.manoeuvre import ManoeuvreData, check_manoeuvres
from sysid_node.errors import InputError


def test_short_or_disordered_manoeuvres_are_refused():
    good = flown(short_period_model())
    with pytest.raises(InputError, match="needs at least 5"):
        ManoeuvreData(good.time[:3], good.inputs[:3], good.outputs[:3], good.initial_state)
    with pytest.raises(InputError, match="time must be finite and increase"):
        dataclasses.replace(good, time=good.time[::-1])
    with pytest.raises(InputError, match="outputs have 499 rows for 500 times; expected 500"):
        with_outputs(good, good.outputs[1:])
    with pytest.raises(InputError, match="initial state"):
        dataclasses.replace(good, initial_state=np.array([0.0, np.nan]))


def test_gaps_in_inputs_are_named():
    model = short_period_model()
    good = flown(model)
    inputs = good.inputs.copy()
    inputs[100:103] = np.nan
    with pytest.raises(InputError, match=r"input de is missing at 2\.000 s \(3 samples in all\)"):
        check_manoeuvres(model, [dataclasses.replace(good, inputs=inputs)])


def test_a_manoeuvre_of_another_model_is_refused():
    model = short_period_model()
    with pytest.raises(InputError, match="no manoeuvre given"):
        check_manoeuvres(model, [])
    with pytest.raises(InputError, match="1 inputs, 2 outputs, 2 states"):
        check_manoeuvres(model, [with_outputs(flown(model), np.zeros((500, 2)))])


def test_an_output_never_measured_is_named():
    model = short_period_model()
    outputs = flown(model).outputs.copy()
    outputs[:, 2] = np.nan
    with pytest.raises(InputError, match="output az was never measured"):
        check_manoeuvres(model, [with_outputs(flown(model), outputs)])
