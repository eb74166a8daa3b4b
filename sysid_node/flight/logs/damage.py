"""Damage in logs: whatever a library raises or prints about it becomes one line."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

from sysid_node.errors import InputError, InputWarning


@contextmanager
def reading_log(path: str | Path) -> Iterator[None]:
    """A context in which the libraries that read logs print nothing, and every error of theirs is an InputError.

    Warns (InputWarning) where they would have printed about damage.
    """
    name, said = Path(path).name, io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            yield
    except (InputError, ImportError):
        raise
    except Exception as error:  # parsers of a damaged file raise all kinds of exceptions
        words = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(f"{name}: is damaged and cannot be read ({words}); copy it from the vehicle again") from error
    lines = [line for line in said.getvalue().splitlines() if line.strip()]
    if lines:
        first = " ".join(lines[0].split())[:100]
        text = f"{name}: is damaged in {len(lines)} places, which are left out, first: {first}"
        warnings.warn(text, InputWarning, stacklevel=3)
