"""What rosbags does not look at in a bag's files: names, sqlite's journals, and sizes of what is compressed."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO, NamedTuple
from zlib import crc32

from sysid_node.errors import InputError

#: The largest chunk that is unpacked, bytes; recorders make chunks of 1 to 10 MB.
CHUNK_LIMIT = 256 * 2**20

_MAGIC, _CHUNK = b"\x89MCAP0\r\n", 0x06
_SUFFIXES = {_MAGIC: ".mcap", b"SQLite format 3\x00": ".db3", b"#ROSBAG V2.0": ".bag"}
_IN_URI = "%?#"  # rosbags opens a database by a URI, in which these do not stand for themselves


class Chunk(NamedTuple):
    """A chunk of an MCAP file."""

    checksum_at: int  # where in the file its checksum is
    unpacked: int  # bytes
    compression: str
    content_at: int
    packed: int  # bytes


@contextmanager
def checked_files(bag: Path) -> Iterator[Path]:
    """The path under which rosbags may read a bag. Raises InputError where its files would be misread.

    A database with messages in a journal beside it would be read without these. One whose path holds %, ? or # would
    be taken for another file, so that it is read through a link. So is one whose name does not say what it holds. A
    chunk that unpacks to more than ``CHUNK_LIMIT`` is refused by its declared size.
    """
    files = sorted(bag.glob("*.*")) if bag.is_dir() else [bag]
    suffix = "" if bag.is_dir() else _suffix(bag)
    for file in files:
        if (suffix or file.suffix) == ".db3":
            _refuse_journal(file)
        if (suffix or file.suffix) == ".mcap" and file.is_file():
            _refuse_bombs(file)
    databases = [file for file in files if (suffix or file.suffix) == ".db3"]
    named_so = bag.suffix != ".bag" if bag.is_dir() else bag.suffix == suffix
    if named_so and not any(mark in str(file.absolute()) for file in databases for mark in _IN_URI):
        yield bag
        return
    odd = [file.name for file in databases if any(mark in file.name for mark in _IN_URI)]
    if bag.is_dir() and odd:
        raise InputError(f"bag {bag.name}: {odd[0]} has one of {_IN_URI} in its name; rename it, and in metadata.yaml")
    with TemporaryDirectory(prefix="sysid-") as folder:
        link = Path(folder, f"bag{suffix}")
        link.symlink_to(bag.absolute())
        yield link


def _suffix(file: Path) -> str:
    """The suffix by which rosbags knows the content of a file; its own where the content is none of a bag."""
    try:
        with file.open("rb") as stream:
            head = stream.read(16)
    except OSError:  # a file that is missing, which the reader says
        return file.suffix
    return next((suffix for magic, suffix in _SUFFIXES.items() if head.startswith(magic)), file.suffix)


@contextmanager
def writable_path(bag: Path, storage: str) -> Iterator[Path]:
    """The path under which rosbags writes a bag to ``bag``: through a link where it would take it for a URI.

    Raises InputError where the name itself, which is also the database's, holds %, ? or #.
    """
    if storage != "sqlite3" or not any(mark in str(bag.absolute()) for mark in _IN_URI):
        yield bag
        return
    if any(mark in bag.name for mark in _IN_URI):
        raise InputError(f"bag {bag}: the name of a sqlite3 bag may hold none of {_IN_URI}; choose another, or mcap")
    bag.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix="sysid-") as folder:
        link = Path(folder, "bags")
        link.symlink_to(bag.parent.absolute())
        yield link / bag.name


def add_checksums(file: Path) -> None:
    """Write the checksum of every uncompressed chunk of an MCAP file; rosbags writes zero, which means none."""
    with file.open("r+b") as stream:
        for chunk in list(chunks(stream)):
            if chunk.compression == "":
                stream.seek(chunk.content_at)
                checksum = crc32(stream.read(chunk.packed))
                stream.seek(chunk.checksum_at)
                stream.write(struct.pack("<I", checksum))


def chunks(stream: BinaryIO) -> Iterator[Chunk]:
    """The chunks of an MCAP file as their headers declare them (mcap.dev/spec), as far as the file goes."""
    if stream.read(len(_MAGIC)) != _MAGIC:
        return
    at = len(_MAGIC)
    while len(head := stream.read(9)) == 9:
        code, length = struct.unpack("<BQ", head)
        if code == _CHUNK:
            header = stream.read(32)
            if len(header) < 32:
                return
            unpacked, _, name_length = struct.unpack_from("<QII", header, 16)
            name = stream.read(min(name_length, 100)).decode("utf-8", "replace")
            size = stream.read(8)
            if len(size) < 8:
                return
            packed = struct.unpack("<Q", size)[0]
            yield Chunk(at + 9 + 24, unpacked, name, at + 9 + 40 + name_length, packed)
        at += 9 + length
        try:
            stream.seek(at)
        except (OSError, OverflowError, ValueError):  # the length is damaged
            return


def _refuse_bombs(file: Path) -> None:
    with file.open("rb") as stream:
        for chunk in chunks(stream):
            if chunk.unpacked > CHUNK_LIMIT:
                raise InputError(
                    f"bag {file.name}: a chunk of {chunk.packed / 1e6:.1f} MB unpacks to {chunk.unpacked / 1e6:.0f} MB,"
                    f" over {CHUNK_LIMIT / 1e6:.0f} MB; record with smaller chunks"
                )


def _refuse_journal(file: Path) -> None:
    for end in ("-wal", "-journal"):
        journal = file.with_name(file.name + end)
        if journal.is_file() and journal.stat().st_size:
            raise InputError(
                f"bag {file.name}: {journal.name} beside it holds messages that are not in it yet (was the recorder "
                f'killed, or does it still run?); run: sqlite3 {file} "PRAGMA wal_checkpoint(TRUNCATE)"'
            )
