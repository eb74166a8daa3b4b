"""What flight not fitted says of an explanation. Truth: an explanation of which no numbers come explains nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid_node.gap import holdout


def test_causes_that_predict_no_numbers_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """As slopes of a mode that feeds itself on flight not fitted, without end."""
    bare = SimpleNamespace(information=np.eye(2))
    explained = SimpleNamespace(information=-np.eye(2), without_causes=lambda: bare)
    monkeypatch.setattr(holdout, "check", lambda attribution, *_: np.linalg.cholesky(attribution.information))
    left, checked = holdout._checked(explained, (), ())
    assert left is bare and np.array_equal(checked, np.eye(2))
    assert holdout._checked(bare, (), ())[0] is bare
