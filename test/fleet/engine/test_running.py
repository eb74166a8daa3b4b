"""Flights on real Dask workers: results, refusals, killed and slow workers, and how many jobs are in memory."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from stub_work import double, moody, slowly

from sysid_node.errors import InputError
from sysid_node.fleet.engine.cluster import Workers, connected, local_workers
from sysid_node.fleet.engine.guarded import Returned
from sysid_node.fleet.engine.running import Job, Limits, run


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    with local_workers(2, "2GB") as opened:
        yield opened


def outcomes(workers: Workers, words: list[str], folder: Path, limits: Limits) -> dict[str, Returned[str]]:
    found = {}
    jobs = (Job(word, (word, str(folder))) for word in words)
    run(workers.client, jobs, moody, lambda job, back: found.update({job.name: back}), limits, workers.revive)
    return found


def test_every_job_comes_back_once_and_few_are_in_memory(workers: Workers) -> None:
    drawn, found, most = [], {}, 0

    def jobs() -> Iterator[Job[int]]:
        nonlocal most
        for number in range(40):
            drawn.append(number)
            most = max(most, len(drawn) - len(found))
            yield Job(str(number), number)

    run(workers.client, jobs(), double, lambda job, back: found.update({job.name: back.result}))
    assert found == {str(number): 2 * number for number in range(40)}
    assert most <= 6  # two workers, two jobs that wait, one that is drawn, one that has just come back


def test_refusals_and_warnings_come_back_as_one_line_and_are_not_tried_again(workers: Workers, tmp_path: Path) -> None:
    found = outcomes(workers, ["refused", "broken", "warns"], tmp_path, Limits(60.0, 3))
    assert (found["refused"].refusal, found["refused"].broken) == ("refused: no airspeed in it; record it too", False)
    assert (found["broken"].refusal, found["broken"].broken) == (
        "failed: ZeroDivisionError: a fault of the program",
        True,
    )
    assert (found["warns"].result, found["warns"].remarks) == ("WARNS", ("the flight is short",))
    assert {path.name: path.stat().st_size for path in tmp_path.iterdir()} == {"refused": 1, "broken": 1, "warns": 1}


def test_workers_are_processes_of_their_own(workers: Workers, tmp_path: Path) -> None:
    workers.client.wait_for_workers(2)
    found = []
    jobs = (Job(str(i), (0.3, str(tmp_path / str(i)))) for i in range(4))
    run(workers.client, jobs, slowly, lambda job, back: found.append(back.result))
    assert len(set(found)) == 2
    assert os.getpid() not in found


@pytest.mark.slow
def test_a_killed_worker_costs_an_attempt_and_a_slow_flight_is_ended(workers: Workers, tmp_path: Path) -> None:
    found = outcomes(workers, ["once killed", "too slow", "plain"], tmp_path, Limits(4.0, 1))
    assert found["once killed"].result == "ONCE KILLED"
    assert found["plain"].result == "PLAIN"
    assert found["too slow"].refusal.startswith("took longer than 4 s")
    assert (tmp_path / "once killed").stat().st_size == 2
    assert (tmp_path / "too slow").stat().st_size == 2


def test_a_scheduler_that_does_not_answer_is_one_line() -> None:
    with pytest.raises(InputError, match="no scheduler answers"), connected("tcp://127.0.0.1:1", 1.0):
        pass


def test_a_memory_that_is_no_size_is_one_line() -> None:
    with pytest.raises(InputError, match="--memory 'much': expected a size"), local_workers(1, "much"):
        pass
