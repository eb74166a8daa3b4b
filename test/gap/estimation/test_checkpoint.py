"""Finished steps are taken up again, and never those of another flight."""

import numpy as np
import pytest

from sysid_node.gap.estimation import checkpoint as module
from sysid_node.gap.estimation.checkpoint import Steps
from sysid_node.gap.estimation.fit import blank, with_candidates
from sysid_node.gap.estimation.nuisances import nuisances_of


@pytest.fixture
def start(aircraft, plain_view):
    nuisances = nuisances_of(aircraft, plain_view)
    return with_candidates(blank([plain_view], nuisances), [], nuisances, ())


def test_a_finished_fit_is_not_fitted_again(tmp_path, plain_view, start, monkeypatch) -> None:
    first = Steps.of(tmp_path / "kept", [plain_view]).polished(start)
    monkeypatch.setattr(module, "polish", lambda fit: pytest.fail("fitted again"))
    again = Steps.of(tmp_path / "kept", [plain_view]).polished(start)
    np.testing.assert_array_equal(again.points[0], first.points[0])
    assert again.cost == pytest.approx(first.cost)


def test_another_start_is_another_step(tmp_path, plain_view, start) -> None:
    steps = Steps.of(tmp_path, [plain_view])
    assert steps.table(start, ["a"], lambda: {"a": [1.0]}) == {"a": [1.0]}
    assert steps.table(start, ["a"], lambda: pytest.fail("worked out again")) == {"a": [1.0]}
    moved = with_candidates(start, [], start.nuisances, ())
    moved.points[0][start.nuisances.indices[0]] += 1e-3
    assert steps.table(moved, ["b"], lambda: {"b": [2.0]}) == {"b": [2.0]}


def test_nothing_is_left_at_the_end(tmp_path, plain_view, start) -> None:
    steps = Steps.of(tmp_path / "kept", [plain_view])
    steps.table(start, ["a"], lambda: {"a": [1.0]})
    steps.forget()
    assert not (tmp_path / "kept").exists()


def test_without_a_folder_nothing_is_written(tmp_path, start, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Steps().table(start, ["a"], lambda: {"a": [1.0]})
    assert not any(tmp_path.iterdir())
