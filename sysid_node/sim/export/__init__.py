"""The aircraft as a model for other simulators: one module a format, each an ``Aircraft`` to text."""
