"""The state file: what is kept comes back to the bit, and nothing that was finished is lost."""

import datetime
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid_node.errors import InputError
from sysid_node.fleet.outcome import FlightOutcome
from sysid_node.fleet.state.fingerprints import fingerprint, known_hash
from sysid_node.fleet.state.store import STATE, FleetState


def outcome() -> FlightOutcome:
    rng = np.random.default_rng(5)
    root = rng.normal(size=(2, 3, 3))
    total, statistical = root @ root.transpose(0, 2, 1)
    names = ("CL_alpha", "Cm_alpha", "Cm_q")
    date = datetime.datetime(2026, 5, 3, 9, 30, tzinfo=datetime.UTC)
    valid = np.array([True, False, True])
    return FlightOutcome(
        "cdrw", "7", date, 60.0, names, rng.normal(size=3), total, statistical, valid, {"verdict": "no_gap"}
    )


def test_what_is_kept_comes_back_to_the_bit(tmp_path: Path) -> None:
    kept = outcome()
    state = FleetState(tmp_path / STATE)
    state.keep("a", "1", kept, report="flights/a/report.html", remarks=("short",), took=2.0)
    state.refuse("b", "2", "b: no airspeed", aircraft="cdrw", lost=False)
    state.refuse("c", "3", "its process ended", aircraft="cdrw", lost=True)
    state.close()
    again = FleetState(tmp_path / STATE)
    assert again.fingerprints() == {"a": "1", "b": "2"}  # a lost one is tried again
    found = {entry.flight: entry for entry in again.entries()}
    back = found["a"].outcome
    assert back is not None
    for name in ("values", "covariance", "statistical_covariance", "valid"):
        np.testing.assert_array_equal(getattr(back, name), getattr(kept, name))
    assert (back.names, back.date, back.data_seconds, back.vehicle) == (kept.names, kept.date, 60.0, "7")
    assert dict(found["a"].gap or {}) == {"verdict": "no_gap"}
    assert (found["a"].report, found["a"].remarks, found["a"].took) == ("flights/a/report.html", ("short",), 2.0)
    assert (found["b"].reason, found["b"].outcome) == ("b: no airspeed", None)
    again.close()


def test_a_kill_at_any_moment_loses_nothing_that_was_kept(tmp_path: Path) -> None:
    """A process keeps flight after flight and says so; it is killed; what it has said is in the file."""
    program = (
        "import sys; from pathlib import Path; from test_store import outcome\n"
        "from sysid_node.fleet.state.store import FleetState\n"
        "state = FleetState(Path(sys.argv[1])); kept = outcome()\n"
        "for i in range(100000):\n"
        "    state.keep(str(i), 'x', kept, report=None); print(i, flush=True)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    path = tmp_path / STATE
    with subprocess.Popen([sys.executable, "-c", program, path], stdout=subprocess.PIPE, env=environment) as process:
        assert process.stdout is not None
        said = [process.stdout.readline() for _ in range(25)]
        process.send_signal(signal.SIGKILL)
        said += process.stdout.readlines()
    told = [int(line) for line in said if line.endswith(b"\n")]
    state = FleetState(path)
    assert set(map(str, told)) <= state.fingerprints().keys()
    assert len(list(state.entries())) <= len(told) + 1
    state.close()


def test_a_full_disk_is_one_line_and_loses_nothing(tmp_path: Path) -> None:
    """The size of files is limited in a process, as a full disk limits it."""
    program = (
        "import resource, signal, sys; from pathlib import Path; from test_store import outcome\n"
        "from sysid_node.errors import InputError; from sysid_node.fleet.state.store import FleetState\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "state = FleetState(Path(sys.argv[1])); state.keep('first', 'x', outcome(), report=None)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (60000, 60000))\n"
        "try:\n"
        "    for i in range(1000): state.keep(str(i), 'x', outcome(), report=None)\n"
        "except InputError as error: print(error)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    path = tmp_path / STATE
    run = [sys.executable, "-c", program, path]
    done = subprocess.run(run, capture_output=True, text=True, env=environment, check=True)
    assert "make room and start again; what was finished is kept" in done.stdout
    assert len(done.stdout.splitlines()) == 1
    state = FleetState(path)
    assert "first" in state.fingerprints()
    state.close()


def test_a_file_that_is_no_state_is_one_line(tmp_path: Path) -> None:
    (tmp_path / STATE).write_text("no database at all, and longer than a header of SQLite is" * 20)
    with pytest.raises(InputError, match="cannot be read or written"):
        FleetState(tmp_path / STATE)


def test_a_log_is_hashed_again_only_when_it_was_written(tmp_path: Path) -> None:
    log, state = tmp_path / "flight.csv", FleetState(tmp_path / STATE)
    log.write_text("time,p\n0,1\n")
    first = known_hash(log, state.known_hash, state.remember_hash)
    read = []
    assert known_hash(log, state.known_hash, lambda *args: read.append(args)) == first
    assert read == []
    log.write_text("time,p\n0,2\n")
    assert known_hash(log, state.known_hash, state.remember_hash) != first
    state.close()


def test_a_fingerprint_differs_by_log_aircraft_and_settings() -> None:
    base = ("log", "aircraft", {"method": "", "settings": {"window": "20"}})
    others = [("other", *base[1:]), (base[0], "other", base[2]), (*base[:2], {**base[2], "gap": True})]
    assert len({fingerprint(*base), *(fingerprint(*other) for other in others)}) == 4
    assert fingerprint(*base) == fingerprint("log", "aircraft", dict(reversed(base[2].items())))


def test_an_outcome_of_nothing_is_kept_too(tmp_path: Path) -> None:
    empty = replace(outcome(), names=(), values=np.empty(0), valid=np.empty(0, bool), gap=None, date=None)
    empty = replace(empty, covariance=np.empty((0, 0)), statistical_covariance=np.empty((0, 0)))
    state = FleetState(tmp_path / STATE)
    state.keep("a", "1", empty, report=None)
    (entry,) = state.entries()
    assert entry.outcome is not None
    assert (entry.outcome.covariance.shape, entry.outcome.date, entry.gap) == ((0, 0), None, None)
    state.close()
