"""A scheduler and a worker that run already, and what is said when the scheduler ends; real processes of Dask."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from stub_work import slowly

from sysid_node.errors import InputError
from sysid_node.fleet.engine.cluster import connected
from sysid_node.fleet.engine.running import Job, run

OPTIONS = {"scheduler": ("--port", "0", "--host", "127.0.0.1"), "worker": ("--nthreads", "1", "--no-nanny")}


@pytest.fixture
def running(tmp_path: Path) -> Iterator[tuple[subprocess.Popen, str]]:
    """A scheduler with one worker; its process and its address."""
    file = tmp_path / "scheduler.json"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    processes = []
    with (tmp_path / "log").open("w") as log:
        for kind, options in OPTIONS.items():
            words = [sys.executable, "-m", "dask", kind, *options, "--no-dashboard", "--scheduler-file", str(file)]
            processes.append(subprocess.Popen(words, stdout=log, stderr=log, env=environment, cwd=tmp_path))
        for _ in range(300):
            if "Starting established connection" in (tmp_path / "log").read_text():
                break
            time.sleep(0.1)
        yield processes[0], json.loads(file.read_text())["address"]
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_a_killed_scheduler_is_one_line_and_what_came_back_is_kept(
    running: tuple[subprocess.Popen, str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scheduler, address = running
    kept = []

    def done(job: Job, back: object) -> None:
        kept.append(job.name)
        scheduler.kill()

    jobs = (Job(str(i), (0.3, str(tmp_path / str(i)))) for i in range(20))
    lost = pytest.raises(InputError, match="does not answer any more; what had come back is kept")
    with connected(address) as workers, lost:
        run(workers.client, jobs, slowly, done)
    assert 1 <= len(kept) < 20
    assert capfd.readouterr().err == ""
