"""More nats make a cause more credible, what it leaves less; neither says that it is certain."""

from hypothesis import given
from hypothesis import strategies as st

from sysid_node.gap.selection.calibration import CauseEvidence
from sysid_node.gap.thresholds import THRESHOLDS

LIKELY, REFUTED = THRESHOLDS.calibration.probability, THRESHOLDS.calibration.misfit
NATS, MISFITS = st.floats(-1e3, 1e6), st.floats(0.0, 2.0)


@given(NATS, st.floats(0.0, 1e5), MISFITS)
def test_more_nats_are_more_credible(nats, more, misfit) -> None:
    assert (
        CauseEvidence(nats, misfit, flexible=False).probability_by_evidence
        <= CauseEvidence(nats + more, misfit, flexible=False).probability_by_evidence
    )


@given(NATS, MISFITS, st.floats(0.0, 1.0))
def test_what_is_left_counts_against_a_cause(nats, misfit, more) -> None:
    assert (
        CauseEvidence(nats, misfit + more, flexible=False).probability_by_evidence
        <= CauseEvidence(nats, misfit, flexible=False).probability_by_evidence
    )


@given(NATS)
def test_what_leaves_nothing_is_not_wanting(nats) -> None:
    assert not CauseEvidence(nats, 0.0, flexible=False).supported_but_misspecified


@given(NATS)
def test_a_law_that_is_refuted_is_not_believed(nats) -> None:
    """More data of a wrong law are more nats."""
    grounds = CauseEvidence(nats, 2.0 * REFUTED, flexible=False)
    assert grounds.probability_by_evidence == 0.0
    assert grounds.supported_but_misspecified is (
        CauseEvidence(nats, 0.0, flexible=False).probability_by_evidence >= LIKELY
    )


def test_nothing_foretold_is_not_believed() -> None:
    assert CauseEvidence(0.0, 0.0, flexible=False).probability_by_evidence < LIKELY
    assert CauseEvidence(1e4, 0.0, flexible=False).probability_by_evidence > LIKELY
