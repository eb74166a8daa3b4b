"""Damage in logs: whatever a library raises or prints about it becomes one line."""

from __future__ import annotations

import io
import os
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from functools import partial
from pathlib import Path

from sysid_node.errors import InputError, InputWarning
from sysid_node.interruption import on_interrupt

_STDERR = 2  # the process's own, into which compiled libraries write


@contextmanager
def reading_log(path: str | Path) -> Iterator[None]:
    """A context in which the libraries that read logs print nothing, and every error of theirs is an InputError.

    Warns (InputWarning) where they would have printed about damage.
    """
    name = Path(path).name
    messages: list[str] = []
    try:
        with _collected(messages):
            yield
    except (InputError, ImportError):
        raise
    except Exception as error:  # parsers of a damaged file raise all kinds of exceptions
        words = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(f"{name}: is damaged and cannot be read ({words}); copy it from the vehicle again") from error
    if messages:
        first = " ".join(messages[0].split())[:100]
        text = f"{name}: is damaged in {len(messages)} places, which are left out, first: {first}"
        warnings.warn(text, InputWarning, stacklevel=3)


@contextmanager
def _collected(messages: list[str]) -> Iterator[None]:
    """Put the lines that are printed, by Python and by compiled code, into ``said``."""
    printed = io.StringIO()
    with tempfile.TemporaryFile() as written:
        before = os.dup(_STDERR)
        os.dup2(written.fileno(), _STDERR)
        try:
            with (
                on_interrupt(partial(_restore, before)),
                redirect_stdout(printed),
                redirect_stderr(printed),
            ):
                yield
        finally:
            _restore(before)
            os.close(before)
        written.seek(0)
        lines = [*printed.getvalue().splitlines(), *written.read(2**20).decode("utf-8", "replace").splitlines()]
        messages += [line for line in lines if line.strip()]


def _restore(before: int) -> None:
    os.dup2(before, _STDERR)
