"""A lock on a folder, by which two runs cannot write into it at once."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from sysid_node.errors import InputError


def lock_folder(folder: Path, busy: str) -> int:
    """A descriptor that holds the folder's lock until it is closed.

    Raises InputError with the words ``busy`` where another run holds the lock, and OSError where the folder cannot be
    opened. On a file system without locks nothing is locked.
    """
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise InputError(busy) from None
    except OSError:
        pass
    return lock
