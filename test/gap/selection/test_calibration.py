"""More nats make a cause more credible, what it leaves less; neither says that it is certain."""

from hypothesis import given
from hypothesis import strategies as st

from sysid_node.gap.selection.calibration import Grounds
from sysid_node.gap.thresholds import THRESHOLDS

LIKELY, REFUTED = THRESHOLDS.calibration.probability, THRESHOLDS.calibration.misfit
NATS, MISFITS = st.floats(-1e3, 1e6), st.floats(0.0, 2.0)


@given(NATS, st.floats(0.0, 1e5), MISFITS)
def test_more_nats_are_more_credible(nats, more, misfit) -> None:
    assert Grounds(nats, misfit, pliable=False).credence <= Grounds(nats + more, misfit, pliable=False).credence


@given(NATS, MISFITS, st.floats(0.0, 1.0))
def test_what_is_left_counts_against_a_cause(nats, misfit, more) -> None:
    assert Grounds(nats, misfit + more, pliable=False).credence <= Grounds(nats, misfit, pliable=False).credence


@given(NATS)
def test_what_leaves_nothing_is_not_wanting(nats) -> None:
    assert not Grounds(nats, 0.0, pliable=False).wanting


@given(NATS)
def test_a_law_that_is_refuted_is_not_believed(nats) -> None:
    """More data of a wrong law are more nats."""
    grounds = Grounds(nats, 2.0 * REFUTED, pliable=False)
    assert grounds.credence == 0.0
    assert grounds.wanting is (Grounds(nats, 0.0, pliable=False).credence >= LIKELY)


def test_nothing_foretold_is_not_believed() -> None:
    assert Grounds(0.0, 0.0, pliable=False).credence < LIKELY
    assert Grounds(1e4, 0.0, pliable=False).credence > LIKELY
