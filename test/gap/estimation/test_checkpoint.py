"""Finished steps are taken up again, and never those of another flight."""

import numpy as np
import pytest

from sysid_node.gap.estimation import checkpoint as module
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.fit import unfitted, with_candidates
from sysid_node.gap.estimation.nuisances import nuisances_of


@pytest.fixture
def start(aircraft, plain_model):
    nuisances = nuisances_of(aircraft, plain_model)
    return with_candidates(unfitted([plain_model], nuisances), [], nuisances, ())


def test_a_finished_fit_is_not_fitted_again(tmp_path, plain_model, start, monkeypatch) -> None:
    first = Checkpoint.of(tmp_path / "kept", [plain_model]).polished(start)
    monkeypatch.setattr(module, "converged", lambda fit: pytest.fail("fitted again"))
    again = Checkpoint.of(tmp_path / "kept", [plain_model]).polished(start)
    np.testing.assert_array_equal(again.points[0], first.points[0])
    assert again.cost == pytest.approx(first.cost)


def test_another_start_is_another_step(tmp_path, plain_model, start) -> None:
    steps = Checkpoint.of(tmp_path, [plain_model])
    assert steps.table(start, ["a"], lambda: {"a": [1.0]}) == {"a": [1.0]}
    assert steps.table(start, ["a"], lambda: pytest.fail("worked out again")) == {"a": [1.0]}
    moved = with_candidates(start, [], start.nuisances, ())
    moved.points[0][start.nuisances.indices[0]] += 1e-3
    assert steps.table(moved, ["b"], lambda: {"b": [2.0]}) == {"b": [2.0]}


def test_nothing_is_left_at_the_end(tmp_path, plain_model, start) -> None:
    steps = Checkpoint.of(tmp_path / "kept", [plain_model])
    steps.table(start, ["a"], lambda: {"a": [1.0]})
    steps.forget()
    assert not (tmp_path / "kept").exists()


def test_without_a_folder_nothing_is_written(tmp_path, start, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Checkpoint().table(start, ["a"], lambda: {"a": [1.0]})
    assert not any(tmp_path.iterdir())
