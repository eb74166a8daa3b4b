"""The reference model when it takes other values: what was learned from the flight must fit them as the old ones."""

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.faults.model import reference_model
from sysid_node.faults.model.reference_model import KEPT, RIPE, IdentifierEstimate, IdentifierEstimates, ReferenceModel
from sysid_node.faults.model.terms import design_of, terms
from sysid_node.online.frequency import regression_signals
from sysid_node.online.frequency.regression_signals import OFFSET

BLOCKS = 40
MEAN = 0.1  # rad, angle of attack about which it varies


def flown(reference: ReferenceModel) -> list[tuple[np.ndarray, np.ndarray]]:
    """The designs (6, D) and outputs (6,) of blocks about a trim that is not zero, as the reference has it."""
    random = np.random.default_rng(1)
    layout = regression_signals.layout(load_aircraft("cdrw"))
    found = []
    for _ in range(BLOCKS):
        regressors = MEAN + 0.02 * random.standard_normal(layout.width)
        regressors[OFFSET] = 1.0
        design = design_of(reference.terms, reference.values, regressors, np.zeros(reference.terms.column.size))
        found.append((design, design @ reference.values + 1e-3 * random.standard_normal(6)))
    return found


def learned(reference: ReferenceModel, blocks: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """(D,) the score of the blocks about the values and offsets that the reference has now, forgotten as there."""
    scores = [X.T @ (y - X @ reference.values - reference.offsets) for X, y in blocks]  # OFFSET's regressor is one
    return KEPT ** np.arange(BLOCKS)[::-1] @ np.array(scores)


@pytest.mark.parametrize("name", ["CL_alpha", "Cm_de", "CL_0"])
def test_what_was_learned_is_about_the_values_that_are_adopted(name: str) -> None:
    """Truth: the score of the same blocks, summed again about the new values and offsets."""
    aircraft = load_aircraft("cdrw")
    reference = reference_model.init(terms(aircraft, regression_signals.layout(aircraft)))
    blocks = flown(reference)
    plain = reference.terms.derivatives
    reference.regressors[plain] = np.mean([X.sum(axis=0) for X, _ in blocks], axis=0)[plain]
    every = np.ones(len(reference.terms.names), dtype=bool)
    for X, y in blocks:
        reference_model.learn(reference, X.T @ X, X.T @ (y - X @ reference.values), every, {})
    d = reference.terms.names.index(name)
    other = IdentifierEstimate(1.2 * float(reference.values[d]) + 0.01, 0.01, valid=True)
    reference_model.receive_estimates(reference, 0.0, IdentifierEstimates({name: other}, {}, changed=False))
    assert reference_model.adopt_estimates(reference, RIPE)
    assert reference.values[d] == other.value
    np.testing.assert_allclose(reference.v, learned(reference, blocks), rtol=1e-9, atol=1e-9)
