"""Where logs lie: on this machine, or anywhere that fsspec opens (s3://, gs://, https://, sftp:// ...)."""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import fsspec

from sysid_node.errors import InputError


def is_remote(location: str) -> bool:
    """Whether a location is an address, as ``s3://bucket/flight.ulg``, and no path of this machine."""
    return "://" in location


def expanded(pattern: str, base: Path) -> list[str]:
    """The locations that a path or a pattern with ``*``, ``?`` or ``[`` stands for; relative ones lie under ``base``.

    A path without such marks is itself. Raises InputError where an address cannot be opened.
    """
    if is_remote(pattern):
        if not has_marks(pattern):
            return [pattern]
        system, path = _remote(pattern)
        try:
            return sorted(str(system.unstrip_protocol(found)) for found in system.glob(path))
        except Exception as error:  # every file system raises its own exceptions
            raise _unreadable(pattern, error) from error
    whole = base / Path(pattern).expanduser()
    if exists(str(whole)) or not has_marks(pattern):
        return [str(whole)]
    anchor = Path(whole.anchor)
    return sorted(str(path) for path in anchor.glob(str(whole.relative_to(anchor))))


def exists(location: str) -> bool:
    """Whether there is something at a location. Raises InputError where its file system cannot be opened."""
    if not is_remote(location):
        return os.path.exists(location)  # noqa: PTH110  # of a name of any length
    system, path = _remote(location)
    try:
        return bool(system.exists(path))
    except Exception as error:
        raise _unreadable(location, error) from error


def remote_hash(location: str) -> str:
    """A hash of what the file system says of a remote log's content: its tag, or its size and time of change.

    Raises InputError where it cannot be reached.
    """
    system, path = _remote(location)
    try:
        names = sorted(system.find(path)) if system.isdir(path) else [path]
        keys = [f"{name}:{system.ukey(name)}" for name in names]
    except Exception as error:
        raise _unreadable(location, error) from error
    return hashlib.sha256("\n".join(keys).encode()).hexdigest()


def local_copy(location: str, cache: Path) -> Path:
    """The path of a log on this machine: its own, or that of a copy in ``cache``, which is made where it is missing.

    A copy lies in a folder named after ``remote_hash``: when the remote log changes, another copy is made. A copy is
    moved into place when it is whole. Raises InputError where it cannot be fetched.
    """
    if not is_remote(location):
        return Path(location)
    name = location.rstrip("/").rpartition("/")[2]
    folder = cache / remote_hash(location)[:32]
    if (folder / name).exists():
        return folder / name
    system, path = _remote(location)
    try:
        cache.mkdir(parents=True, exist_ok=True)
        stage = Path(tempfile.mkdtemp(prefix=".fetch-", dir=cache))
        try:
            system.get(path, str(stage / name), recursive=bool(system.isdir(path)))
            if not folder.exists():
                stage.rename(folder)
        finally:
            shutil.rmtree(stage, ignore_errors=True)
    except Exception as error:
        if (folder / name).exists():  # another worker was faster
            return folder / name
        raise _unreadable(location, error) from error
    return folder / name


def has_marks(pattern: str) -> bool:
    """Whether a path is a pattern: whether it has ``*``, ``?`` or ``[``."""
    return any(mark in pattern for mark in "*?[")


def _remote(location: str) -> tuple[Any, str]:
    try:
        system, path = fsspec.core.url_to_fs(location)
    except Exception as error:
        raise _unreadable(location, error) from error
    return system, path


def _unreadable(location: str, error: Exception) -> InputError:
    words = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    return InputError(f"{location}: cannot be opened ({words})")
