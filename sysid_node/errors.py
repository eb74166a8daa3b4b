"""The error for bad input, and the warnings about input and about a model."""


class InputError(ValueError):
    """Bad input: one line that says what was wrong, where, and what to do. The CLI exits with 2."""


class ModelWarning(UserWarning):
    """Something in a model that is taken as it is but that its author should know. The CLI prints it as one line."""


class InputWarning(UserWarning):
    """Something in an input that is taken as it is but that its user should know. The CLI prints it as one line."""
