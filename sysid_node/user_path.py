"""Paths as users write them where no shell reads them: in parameters of nodes and in files."""

from __future__ import annotations

from pathlib import Path

from sysid_node.errors import InputError


def user_path(path: str | Path) -> Path:
    """The path, with a home directory for a ``~`` or ``~user`` at its beginning. Raises InputError on a wrong user."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise InputError(f"{path}: no home directory for the ~ at the beginning; write it out") from None
