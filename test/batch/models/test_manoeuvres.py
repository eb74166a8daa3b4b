"""Flight records as the data of a model."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, clean

from sysid_node.batch.models.manoeuvres import cut_into_segments, manoeuvre_data, record_for_model
from sysid_node.batch.models.rigid_body import STATES, rigid_body
from sysid_node.errors import InputError


def test_pieces_cover_the_flight():
    record = clean()
    pieces = cut_into_segments(record, 5.0)
    assert len(pieces) == 3
    assert sum(map(len, pieces)) == len(record)
    assert max(piece.duration for piece in pieces) <= 5.0
    assert pieces[1].name == "kestrel +1 [2/3]"
    assert cut_into_segments(record, 0.0) == [record]
    with pytest.raises(InputError, match=r"cannot be cut into segments of 0\.01 s"):
        cut_into_segments(record, 0.01)


def test_columns_become_inputs_outputs_and_the_initial_state():
    record = clean()
    model = rigid_body(KESTREL, ("alpha", "q"), ("q", "qdot"))
    prepared = record_for_model(model, KESTREL, record)
    data = manoeuvre_data(model, prepared, {"alpha": 0.07}, every=4)
    np.testing.assert_array_equal(data.inputs[:, model.inputs.index("de")], record["de"])
    np.testing.assert_allclose(data.outputs[:, 0], record["q"].reshape(-1, 4).mean(axis=1), rtol=1e-12)
    # the angular acceleration that no sensor gives is the derivative of the rate
    inside = slice(10, -10)
    np.testing.assert_allclose(
        data.outputs[inside, 1], np.gradient(record["q"], record.time).reshape(-1, 4).mean(axis=1)[inside], atol=0.5
    )
    assert data.initial_state.tolist() == [0.07, record["q"][0]]


def test_the_density_is_the_references_where_none_was_measured():
    record = clean()
    model = rigid_body(KESTREL, tuple(STATES), ())
    thin = dataclasses.replace(record, columns={n: v for n, v in record.columns.items() if n != "rho"})
    assert (record_for_model(model, KESTREL, thin)["rho"] == KESTREL.reference.air_density).all()


def test_an_input_never_measured_is_refused():
    record = clean()
    blind = dataclasses.replace(record, columns={n: v for n, v in record.columns.items() if n != "de"})
    with pytest.raises(InputError, match="model rigid_body needs de, which it did not measure; it has"):
        manoeuvre_data(rigid_body(KESTREL, tuple(STATES), ()), blind)
