"""The packages that read logs, which are needed for logs alone."""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from sysid_node.errors import InputError

#: How they are installed.
INSTALL = "pip install -r requirements/logs.txt"


def required(module: str, reads: str) -> Any:
    """A module of such a package. Raises InputError, which says how to install it, where it is missing."""
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise InputError(
            f"{reads} are read by the package {package}, which is not installed; run: {INSTALL}"
        ) from error


@contextlib.contextmanager
def quietly() -> Iterator[None]:
    """A context in which these packages print and log nothing: what matters of it is said in our own words."""
    level = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            yield
    finally:
        logging.disable(level)
