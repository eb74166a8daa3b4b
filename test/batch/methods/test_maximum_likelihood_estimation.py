"""Output error and filter error set up for whole flights: pieces, start values, joined responses."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, TRUTH, clean, flight

from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.methods.maximum_likelihood_estimation import MaximumLikelihoodEstimation
from sysid_node.batch.settings import BatchSettings
from sysid_node.errors import InputError

LONGITUDINAL = BatchSettings(states=("alpha", "q"), segment=5.0, rate=25.0)


def test_output_error_averages_outputs_and_filter_error_all_signals():
    output, filtered = (
        MaximumLikelihoodEstimation.of(method, KESTREL, [flight(1)], LONGITUDINAL)
        for method in ("output_error", "filter_error")
    )
    assert [len(piece) for piece in output.pieces] == [400] * 3
    assert {piece.every for piece in output.pieces} == {4}
    assert [len(piece) for piece in filtered.pieces] == [100] * 3
    assert {piece.every for piece in filtered.pieces} == {1}
    assert "gust_w" in filtered.model.states
    assert "gust_w" not in output.model.states


def test_the_search_starts_at_equation_errors_estimates():
    estimation = MaximumLikelihoodEstimation.of("output_error", KESTREL, [flight(1)], LONGITUDINAL)
    found = equation_error(KESTREL, [flight(1)]).values
    start = dict(zip(estimation.model.names, estimation.model.start, strict=True))
    assert start["Cm_q"] == pytest.approx(found["Cm_q"])
    assert not estimation.remarks


def test_where_equation_errors_estimates_diverge_the_search_starts_at_the_files():
    """With q of the wrong sign, equation error finds an aircraft that is unstable in pitch."""
    record = flight(1)
    reversed_pitch = dataclasses.replace(record, columns=dict(record.columns) | {"q": -record.columns["q"]})
    assert equation_error(KESTREL, [reversed_pitch]).estimates["Cm_alpha"].value > 0.0
    estimation = MaximumLikelihoodEstimation.of("output_error", KESTREL, [reversed_pitch], BatchSettings())
    start = dict(zip(estimation.model.names, estimation.model.start, strict=True))
    assert start["Cm_alpha"] == TRUTH["Cm_alpha"]
    assert "started from the aircraft file's values" in estimation.remarks[-1]


def test_other_flights_use_the_same_compiled_equations():
    first = MaximumLikelihoodEstimation.of("output_error", KESTREL, [flight(1)], LONGITUDINAL)
    other = first.on([flight(2, turn=-1)])
    assert other.model.dynamics == first.model.dynamics
    assert not np.array_equal(other.pieces[0].outputs, first.pieces[0].outputs)


def test_the_responses_to_the_pieces_are_joined():
    """A held-out flight comes back as one response on its own time."""
    estimation = MaximumLikelihoodEstimation.of("output_error", KESTREL, [clean()], LONGITUDINAL)
    fit = estimation.fit()
    assert [response.name for response in fit.responses] == ["kestrel +1"]
    (response,) = estimation.responses(fit, clean(turn=-1))
    assert response.time[-1] == pytest.approx(clean().duration, abs=0.1)
    assert (np.diff(response.time) > 0.0).all()
    measured, modelled = response.column("q")
    assert np.std(measured - modelled) < 0.05 * np.std(measured)


def test_what_was_not_measured_is_refused():
    record = clean()
    blind = dataclasses.replace(record, columns={n: v for n, v in record.columns.items() if n != "V"})
    with pytest.raises(InputError, match="its airspeed was never measured"):
        MaximumLikelihoodEstimation.of("output_error", KESTREL, [blind], LONGITUDINAL)
