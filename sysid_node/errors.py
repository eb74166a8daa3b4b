"""The error for bad input, and the warnings about input and about a model."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """Bad input: one line that says what was wrong, where, and what to do. The CLI exits with 2."""


class ModelWarning(UserWarning):
    """Something in a model that is taken as it is but that its author should know. The CLI prints it as one line."""


class InputWarning(UserWarning):
    """Something in an input that is taken as it is but that its user should know. The CLI prints it as one line."""


@contextmanager
def noted_warnings(texts: list[str]) -> Iterator[None]:
    """Add the text of every InputWarning that is given inside to ``texts``, once each; all warnings go on from here."""
    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", InputWarning)
            yield
    finally:
        noted = [" ".join(str(one.message).split()) for one in caught if issubclass(one.category, InputWarning)]
        texts.extend(dict.fromkeys(noted))
        for one in caught:
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
