"""The folder of ``--out``: checked before the work begins, and filled only when all results are written.

Results are written aside, into a folder within the folder, and then moved into place. So a full disk, an error or a
signal leaves an earlier run as it was. ``summary.json`` (``gap.json``) lists under ``written`` the command and its
files: a later run of the same command replaces these, and nothing else is ever replaced without being asked to.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from sysid_node.errors import InputError
from sysid_node.interruption import indivisible, on_interrupt
from sysid_node.report.files.outputs.folder_lock import lock_folder
from sysid_node.version import VERSION

STAGE, EARLIER = ".sysid-unfinished", ".sysid-earlier"
#: After a signal the command may still write into the folder that is being removed, which then remains.
_ATTEMPTS = 20
#: The files of which one lists all files of a run, and the key under which it does.
CONTENTS, WRITTEN = ("summary.json", "gap.json", "aircraft.json", "fleet.json"), "written"
#: The aircraft file that a run began with, whole.
AIRCRAFT = "aircraft.yaml"
#: Names of results that earlier versions wrote without a list; ``--force`` removes them.
_UNLISTED = frozenset(
    ["summary.json", "gap.json"]
    + [f"{stem}.csv" for stem in ("derivatives", "estimates", "fits", "signals", "spectra", "responses")]
    + [f"{stem}.csv" for stem in ("correlation", "nuisance", "noise", "structure", "where", "candidates")]
)


@dataclass(frozen=True)
class OutputFolder:
    """A folder that is reserved for a command; ``publish`` fills it."""

    path: Path
    command: str
    force: bool
    working: frozenset[str]  # names of what the command keeps there while it works

    def publish(self, write: Callable[[Path], object]) -> None:
        """Call ``write`` with an empty folder, and move what it wrote into place, all or nothing.

        What an earlier run of the command wrote is removed. Raises InputError where something cannot be written.
        """
        stage = self.path / STAGE
        try:
            with indivisible():  # after a signal nothing is begun any more
                _empty(stage)
            write(stage)
            _list_contents(stage, self.command)
            with indivisible():
                self._move(stage)
        except InputError as error:
            raise InputError(str(error).replace(str(stage), str(self.path))) from error
        except OSError as error:
            raise _not_writable(self.path, error) from error

    def _move(self, stage: Path) -> None:
        """Put the earlier results aside and the new ones in their place; put all back where that fails."""
        earlier = self.path / EARLIER
        _empty(earlier)
        aside, placed = [], []
        try:
            for name in sorted(self._replaced(stage)):
                (self.path / name).rename(earlier / name)
                aside.append(name)
            for item in sorted(stage.iterdir()):
                item.rename(self.path / item.name)
                placed.append(item.name)
        except OSError:
            for name in placed:
                (self.path / name).rename(stage / name)
            for name in aside:
                (earlier / name).rename(self.path / name)
            raise
        finally:
            shutil.rmtree(earlier, ignore_errors=True)

    def _replaced(self, stage: Path) -> set[str]:
        """The entries of the folder that make room: those of an earlier run, and those that the new ones replace."""
        listed = {name.partition("/")[0] for name in _listed(self.path)[1]}
        unlisted = _UNLISTED if self.force else frozenset()
        present = {item.name for item in self.path.iterdir()}
        return present & (listed | unlisted | {item.name for item in stage.iterdir()})

    def check(self) -> None:
        """Raise InputError where the folder holds what an earlier run of this command did not write."""
        command, files = _listed(self.path)
        for item in sorted(_files(self.path)):
            name = item.relative_to(self.path).as_posix()
            top = name.partition("/")[0]
            if top in (STAGE, EARLIER) or top in self.working or (command == self.command and name in files):
                continue
            bag = "/" in name and name not in files
            if self.force and not (bag and top in {"estimates", "flight", "corrected_simulator"}):
                continue
            whose = f"sysid {command} wrote" if name in files else f"sysid {self.command} did not write"
            remedy = "move it, or give" if self.force else "give --force to replace earlier results, or"
            raise InputError(f"{item.parent}: holds {item.name}, which {whose}; {remedy} another folder as --out")


@contextmanager
def output_folder(
    path: str | Path,
    command: str,
    *,
    inputs: Iterable[str | Path] = (),
    force: bool = False,
    working: Iterable[str] = (),
) -> Iterator[OutputFolder]:
    """The folder of ``--out``, reserved for a command while the context lasts; it is made where it is missing.

    ``inputs`` are what the command reads. Raises InputError where the folder cannot be written, holds an input or is
    part of one, is in use by another run, or holds other files than an earlier run of ``command``. With ``force`` such
    files stay, and only those that have the names of results are replaced.
    """
    path = Path(path)
    refuse_inputs(path, inputs)
    made = _make(path)
    try:
        lock = _lock(path)
    except BaseException:
        _remove_empty(made)
        raise
    try:
        found = OutputFolder(path, command, force, frozenset(working))
        found.check()
        try:
            _empty(path / STAGE)
        except OSError as error:
            raise _not_writable(path, error) from error
        with on_interrupt(lambda: _tidy(path, made)):
            yield found
    finally:
        _tidy(path, made)
        os.close(lock)


def refuse_inputs(out: Path, inputs: Iterable[str | Path]) -> None:
    """Raise InputError where ``out`` is one of the inputs, holds one, or is part of one."""
    place = out.resolve()
    for given in inputs:
        source = Path(given).resolve()
        if os.path.exists(source) and (place == source or place in source.parents or source in place.parents):  # noqa: PTH110
            raise InputError(f"--out {out}: would write into the input {given}; give another place")


def _make(path: Path) -> list[Path]:
    """Make the folder; the folders that were made, innermost first."""
    made: list[Path] = []
    try:
        missing = [folder for folder in (path, *path.parents) if not folder.exists()]
        for folder in reversed(missing):
            folder.mkdir(exist_ok=True)
            made.insert(0, folder)
        if not path.is_dir():
            raise InputError(f"--out {path}: cannot be written: it is a file; give a folder")
    except OSError as error:
        _remove_empty(made)
        raise _not_writable(path, error) from error
    return made


def _lock(path: Path) -> int:
    """A descriptor that holds the folder's lock. Raises InputError where another run holds it."""
    try:
        return lock_folder(path, f"--out {path}: another run is writing into it; wait for it or give another folder")
    except OSError as error:
        raise _not_writable(path, error) from error


def _tidy(path: Path, made: list[Path]) -> None:
    """Remove what is unfinished, and folders that were made and hold nothing."""
    for _ in range(_ATTEMPTS):
        shutil.rmtree(path / STAGE, ignore_errors=True)
        if not (path / STAGE).exists():
            break
    _remove_empty(made)


def _remove_empty(made: list[Path]) -> None:
    with suppress(OSError):
        for folder in made:
            folder.rmdir()


def _empty(folder: Path) -> None:
    """Make an empty folder of what is there."""
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir()


def _files(folder: Path) -> Iterator[Path]:
    """All files beneath a folder; links are not followed."""
    for root, _, names in os.walk(folder):
        yield from (Path(root, name) for name in names)


def _list_contents(stage: Path, command: str) -> None:
    """Write the command, the version and the names of all files into the file that lists them."""
    (path,) = (stage / name for name in CONTENTS if (stage / name).exists())
    content = json.loads(path.read_text(encoding="utf-8"))
    files = sorted(item.relative_to(stage).as_posix() for item in _files(stage))
    content[WRITTEN] = {"command": command, "version": VERSION, "files": files}
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def _listed(folder: Path) -> tuple[str, frozenset[str]]:
    """The command that wrote the folder and its files; empty where no list is found."""
    for name in CONTENTS:
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            written = json.loads((folder / name).read_text(encoding="utf-8"))[WRITTEN]
            files = frozenset(str(file) for file in written["files"])
            if name in files:
                return str(written["command"]), files
    return "", frozenset()


def _not_writable(path: Path, error: OSError) -> InputError:
    return InputError(f"--out {path}: cannot be written ({error.strerror or error}); give another folder")
