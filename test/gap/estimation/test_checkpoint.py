"""Finished steps are taken up again, and never those of another flight."""

import pickle

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import unfitted, with_candidates
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import nuisances_of


@pytest.fixture
def start(aircraft, plain_model):
    nuisances = nuisances_of(aircraft, plain_model)
    return with_candidates(unfitted([plain_model], nuisances), [], nuisances, ())


def test_a_finished_fit_is_not_fitted_again(tmp_path, plain_model, start) -> None:
    """Truth: what lies in the file, which is altered so that no fit would give it."""
    first = Checkpoint.of(tmp_path, [plain_model]).converged(start)
    (path,) = tmp_path.iterdir()
    with np.load(path) as kept:
        altered = {name: 1.01 * kept[name] for name in kept.files}
    np.savez(path, **altered)
    again = Checkpoint.of(tmp_path, [plain_model]).converged(start)
    np.testing.assert_array_equal(again.flights[0].point, 1.01 * first.flights[0].point)


def test_a_restored_fit_is_the_one_that_was_stored(tmp_path, plain_model, start) -> None:
    first, again = (Checkpoint.of(tmp_path, [plain_model]).converged(start) for _ in range(2))
    np.testing.assert_array_equal(again.flights[0].point, first.flights[0].point)
    assert again.cost == pytest.approx(first.cost)


def test_another_start_is_another_step(tmp_path, plain_model, start) -> None:
    steps = Checkpoint.of(tmp_path, [plain_model])
    assert steps.table(start, ["a"], lambda: {"a": [1.0]}) == {"a": [1.0]}
    assert steps.table(start, ["a"], lambda: pytest.fail("worked out again")) == {"a": [1.0]}
    moved = with_candidates(start, [], start.nuisances, ())
    moved.flights[0].point[start.nuisances.indices[0]] += 1e-3
    assert steps.table(moved, ["b"], lambda: {"b": [2.0]}) == {"b": [2.0]}


def test_nothing_is_left_at_the_end(tmp_path, plain_model, start) -> None:
    steps = Checkpoint.of(tmp_path / "kept", [plain_model])
    steps.table(start, ["a"], lambda: {"a": [1.0]})
    steps.clear()
    assert not (tmp_path / "kept").exists()


def test_without_a_folder_nothing_is_written(tmp_path, start, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Checkpoint().table(start, ["a"], lambda: {"a": [1.0]})
    assert not any(tmp_path.iterdir())


class Code:
    """An object that would run code where it is unpickled."""

    def __reduce__(self):
        return pytest.fail, ("code of a kept step was run",)


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(path.read_bytes()[:-40]),
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(pickle.dumps(Code())),
        lambda path: np.savez(path, point0=np.array([Code()], object), power0=np.array([Code()], object)),
        lambda path: np.savez(path, point0=np.zeros(3)),
        lambda path: np.savez(path, point0=np.zeros(3), power0=np.zeros(3)),
    ],
)
def test_a_damaged_step_is_made_again_and_no_code_in_it_is_run(tmp_path, plain_model, start, damage) -> None:
    first = Checkpoint.of(tmp_path, [plain_model]).converged(start)
    (path,) = tmp_path.iterdir()
    damage(path)
    again = Checkpoint.of(tmp_path, [plain_model]).converged(start)
    np.testing.assert_array_equal(again.flights[0].point, first.flights[0].point)


@pytest.mark.parametrize("text", ["", '{"a": [1.0', "[1.0]", '{"a": 1.0}', "[" * 100_000])
def test_a_damaged_table_is_made_again(tmp_path, plain_model, start, text) -> None:
    steps = Checkpoint.of(tmp_path, [plain_model])
    steps.table(start, ["a"], lambda: {"a": [1.0]})
    (path,) = tmp_path.iterdir()
    path.write_text(text)
    assert steps.table(start, ["a"], lambda: {"a": [2.0]}) == {"a": [2.0]}
    assert steps.table(start, ["a"], lambda: pytest.fail("worked out again")) == {"a": [2.0]}
