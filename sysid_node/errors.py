"""The error for bad input."""


class InputError(ValueError):
    """Bad input: one line that says what was wrong, where, and what to do. The CLI exits with 2."""
