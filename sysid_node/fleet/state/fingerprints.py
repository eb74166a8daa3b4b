"""Hashes of what a flight's result depends on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from sysid_node.errors import InputError
from sysid_node.version import VERSION

_BLOCK = 2**20  # bytes read at once


def fingerprint(log: str, aircraft: str, settings: Mapping[str, object]) -> str:
    """The hash of a flight's ``log`` (its hash), ``aircraft`` file (its text), settings and the program's version."""
    content = {"log": log, "aircraft": aircraft, "settings": dict(settings), "version": VERSION}
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()


def stamp_of(path: Path) -> str:
    """Sizes and times of change of a file, or of all files of a folder: equal where nothing was written since.

    Raises InputError where it cannot be read.
    """
    try:
        found = [(str(file.relative_to(path)), file.stat()) for file in _files(path)]
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    return json.dumps([[name, stat.st_size, stat.st_mtime_ns] for name, stat in found])


def content_hash(path: Path) -> str:
    """The SHA-256 of a file's content, or of the names and contents of all files of a folder. Raises InputError."""
    digest = hashlib.sha256()
    try:
        for file in _files(path):
            digest.update(f"{file.relative_to(path)}\0{file.stat().st_size}\0".encode())
            with file.open("rb") as stream:
                while block := stream.read(_BLOCK):
                    digest.update(block)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    return digest.hexdigest()


def known_hash(path: Path, known: Callable[[str, str], str | None], remember: Callable[[str, str, str], None]) -> str:
    """The content's hash, read anew only where sizes or times differ from those for which it is ``known``.

    ``known(path, stamp)`` gives the hash that was remembered, ``remember(path, stamp, hash)`` keeps a new one.
    """
    stamp = stamp_of(path)
    found = known(str(path.absolute()), stamp)
    if found is None:
        found = content_hash(path)
        remember(str(path.absolute()), stamp, found)
    return found


def _files(path: Path) -> Iterator[Path]:
    if path.is_dir():
        yield from sorted(file for file in path.rglob("*") if file.is_file())
    else:
        yield path
