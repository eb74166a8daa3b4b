"""The optimiser: better than its start, within the envelope, and honest about what its spec flies."""

from itertools import pairwise

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.excite.information import FisherInformation
from sysid_node.excite.optimise import FlightEnvelope, optimise, posterior_to_prior_ratios
from sysid_node.excite.prediction import Predictor, tolerances_of
from sysid_node.excite.spec import parse_manoeuvre, parse_segments

CDRW = load_aircraft("cdrw")
START = (
    "doublet:elevator:amplitude=0.03:start=0.5",
    "doublet:aileron:amplitude=0.02:start=4:width=0.25",
    "doublet:rudder:amplitude=0.05:start=6",
)
DURATION = 10.0


@pytest.fixture(scope="module")
def predictor():
    return Predictor(CDRW, 50.0)


@pytest.fixture(scope="module")
def optimum(predictor):
    return optimise(predictor, parse_segments(START, CDRW), DURATION, evaluations=40)


@pytest.mark.slow
def test_the_error_falls(optimum):
    assert optimum.cost_best < 0.6 * optimum.cost_start
    assert 30 < optimum.evaluations < 100


def test_the_best_stays_within_the_envelope(optimum):
    assert max(FlightEnvelope().excess(optimum.best.flight).values()) <= 0


def test_the_spec_flies_what_was_found(predictor, optimum):
    again = predictor.predict(parse_manoeuvre(optimum.best.manoeuvre.spec, CDRW, 50.0, DURATION))
    assert np.array_equal(again.flight["de"], optimum.best.flight["de"])
    left = posterior_to_prior_ratios(again.information, tolerances_of(CDRW))
    assert np.sqrt(np.mean(left**2)) == pytest.approx(optimum.cost_best, rel=1e-12)
    assert optimum.counted == predictor.names


def test_what_is_left_combines_file_and_flight():
    """One parameter: 1/variance adds up. Nothing learnt leaves all; a parameter not seen keeps its tolerance."""
    one = FisherInformation(("a", "b"), np.ones(2), np.diag([3.0 / 0.2**2, 0.0]))
    assert np.allclose(posterior_to_prior_ratios(one, np.array([0.2, 7.0])), [0.5, 1.0])


def test_only_the_axis_that_is_moved_counts(predictor):
    segments = parse_segments("doublet:elevator:amplitude=0.02", CDRW)
    found = optimise(predictor, segments, DURATION, evaluations=15)
    assert set(found.counted) <= {name for name in predictor.names if name[:2] in ("CL", "CD", "Cm")}
    assert "Cm_alpha" in found.counted
    assert found.cost_best < found.cost_start


def test_a_narrower_envelope_costs(predictor, optimum):
    narrow = FlightEnvelope(alpha=0.03, beta=0.04, bank=0.3, pitch=0.2, rate=0.5, airspeed=0.1)
    other = optimise(predictor, parse_segments(START, CDRW), DURATION, narrow, evaluations=40)
    assert max(narrow.excess(other.best.flight).values()) <= 0
    assert other.cost_best > optimum.cost_best


def test_an_impossible_envelope_is_an_error(predictor):
    with pytest.raises(InputError, match="leaves the envelope however small"):
        optimise(predictor, parse_segments(START, CDRW), DURATION, FlightEnvelope(alpha=1e-6), evaluations=25)


def test_progress_is_told(predictor):
    seen = []
    optimise(
        predictor,
        parse_segments(START, CDRW),
        DURATION,
        evaluations=20,
        progress=lambda n, cost: seen.append((n, cost)),
    )
    counts, costs = zip(*seen, strict=True)
    assert list(counts) == list(range(1, len(seen) + 1))
    assert all(later <= earlier for earlier, later in pairwise(costs))
