"""What was likely meant by a name that is not known."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``"; did you mean cbar?"`` or nothing."""
    names = list(known)
    matches = [name for name in names if name.casefold() == word.casefold()]
    matches = matches or get_close_matches(word, names, n=1, cutoff=0.5)
    return f"; did you mean {matches[0]!r}?" if matches else ""
