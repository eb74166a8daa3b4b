"""Parameters, models and manoeuvres: what is refused, and in what words."""

import numpy as np
import pytest
from made_models import SHORT_PERIOD, short_period_model

from sysid_node.batch.models.model import ModelParameter
from sysid_node.errors import InputError


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"start": np.nan}, "not a number"),
        ({"start": 2.0, "upper": 1.0}, "outside its bounds"),
        ({"start": 1.0, "lower": 1.0, "upper": 1.0}, "hold no value"),
        ({"start": 1.0, "prior": (1.0, 0.0)}, "above zero"),
    ],
)
def test_impossible_parameters_are_refused(arguments, said):
    with pytest.raises(InputError, match=said):
        ModelParameter("Cm_q", **arguments)


def test_a_name_twice_is_refused():
    with pytest.raises(InputError, match="states named twice: q"):
        short_period_model().changed(states=("q", "q"))


def test_start_values_are_moved_and_clipped():
    model = short_period_model(lower=-100.0).started_at({"Mq": -500.0, "Za": -4.0})
    assert dict(zip(model.names, model.start, strict=True)) == SHORT_PERIOD | {"Mq": -100.0, "Za": -4.0}
    with pytest.raises(InputError, match="no parameter Cm_q; it has Za, Zd"):
        model.started_at({"Cm_q": 1.0})


def test_moving_start_values_keeps_compiled_code():
    model = short_period_model()
    assert hash(model.dynamics) == hash(model.started_at({"Mq": -3.0}).dynamics)
