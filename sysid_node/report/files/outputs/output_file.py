"""A single file, or a bag, as the output of a command: made aside under another name, then moved into place whole."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sysid_node.errors import InputError
from sysid_node.flight.truth import truth_path
from sysid_node.interruption import indivisible, on_interrupt
from sysid_node.report.files.outputs.folder_lock import lock_folder
from sysid_node.report.files.outputs.output_folder import refuse_inputs

_BAG_SUFFIXES = (".mcap", ".db3")


def check_file(path: Path, inputs: Iterable[str | Path], mark: str, *, force: bool) -> None:
    """Raise InputError where a command may not write a file.

    It must be none of the ``inputs``, and what is there must be an earlier file of the command, in whose first 4,000
    characters ``mark`` stands, or ``force`` be given.
    """
    try:
        for given in inputs:
            if Path(given).exists() and path.exists() and path.samefile(given):
                raise InputError(f"--out {path}: is the input {given}; choose another file")
        if path.is_dir():
            raise InputError(f"--out {path}: is a folder; choose another file")
        earlier = path.exists() and mark in path.read_bytes()[:4000].decode("utf-8", "replace")
        there = next(folder for folder in path.absolute().parents if folder.exists())
        allowed = there.is_dir() and os.access(there, os.W_OK)
    except OSError as error:
        raise _not_writable(path, error) from error
    if not allowed:
        raise InputError(f"--out {path}: cannot be written: {there} is no folder to write in; choose another")
    if path.exists() and not (earlier or force):
        raise InputError(f"--out {path}: exists and holds something else; give --force to replace it, or another file")


def write_file(path: Path, text: str) -> None:
    """Write a text aside and move it into place; missing folders are made. Raises InputError where this fails."""
    aside = _aside(path)
    try:
        with indivisible():
            path.parent.mkdir(parents=True, exist_ok=True)
            aside.write_text(text, encoding="utf-8")
            aside.replace(path)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise _not_writable(path, error) from error


@contextmanager
def output_bag(
    path: Path, inputs: Iterable[str | Path] = (), *, force: bool = False, truth: bool = False
) -> Iterator[Path]:
    """The path under which to write a bag, which is moved to ``path`` when the context ends without an error.

    With ``truth`` a truth file is written beside it, which moves along; without, none may be there. Raises InputError
    where the bag exists already (with ``force``: where the folder holds anything but a bag), cannot be written, is one
    of the ``inputs`` or holds one, or where another run is writing it.
    """
    try:
        _check_bag(path, inputs, force=force, truth=truth)
    except OSError as error:
        raise _no_bag(path, error) from error
    folder, lock = _reserve(path)
    try:
        with on_interrupt(lambda: shutil.rmtree(folder, ignore_errors=True)):
            yield folder / path.name
            with indivisible():
                _replace(folder / path.name, path)
    except InputError as error:
        raise InputError(str(error).replace(str(folder / path.name), str(path))) from error
    except OSError as error:
        raise _no_bag(path, error) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def _check_bag(path: Path, inputs: Iterable[str | Path], *, force: bool, truth: bool) -> None:
    refuse_inputs(path, inputs)
    if path.exists() and not force:
        raise InputError(f"bag {path}: exists already; remove it, choose another name, or give --force")
    _refuse_other_files(path)
    if truth_path(path).exists() and not (truth or force):
        raise InputError(f"{truth_path(path)}: is of another flight; remove it, or choose another name for the bag")


def _reserve(path: Path) -> tuple[Path, int]:
    """An empty folder beside a bag, in which it is made, and the descriptor of its lock."""
    folder = _aside(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = lock_folder(folder, f"bag {path}: another run is writing it; wait for it or choose another name")
    except OSError as error:
        raise _no_bag(path, error) from error
    for item in folder.iterdir():  # of a run that was killed
        shutil.rmtree(item) if item.is_dir() else item.unlink()
    return folder, lock


def _replace(made: Path, path: Path) -> None:
    """Move a bag and its truth file into place, over an earlier bag where one is there."""
    if path.exists():
        path.rename(made.with_name("earlier"))
    truth = truth_path(path)
    if truth_path(made).exists():
        truth_path(made).replace(truth)
    elif truth.exists():
        truth.unlink()
    made.rename(path)


def _refuse_other_files(path: Path) -> None:
    """Raise InputError where a folder that is to be replaced holds anything but a bag."""
    if not path.exists():
        return
    if not path.is_dir():
        raise InputError(f"bag {path}: is a file; choose another name")
    names = {item.name for item in path.iterdir()}
    others = sorted(n for n in names if n != "metadata.yaml" and not n.endswith(_BAG_SUFFIXES))
    if others or (names and "metadata.yaml" not in names):
        raise InputError(f"bag {path}: holds {(others or sorted(names))[0]}, so it is no bag; choose another name")


def _aside(path: Path) -> Path:
    """A name beside the path, of a length that every file system takes."""
    return path.with_name(f".sysid-{hashlib.sha256(path.name.encode()).hexdigest()[:12]}")


def _no_bag(path: Path, error: OSError) -> InputError:
    return InputError(f"bag {path}: cannot be written: {error.strerror or error}; choose another place")


def _not_writable(path: Path, error: OSError) -> InputError:
    return InputError(f"--out {path}: cannot be written: {error.strerror or error}; choose another file")
