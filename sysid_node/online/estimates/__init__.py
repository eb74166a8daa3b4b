"""Estimates as they are published: values, 95 % intervals and whether to believe them.

``current_solution`` solves with all samples so far, ``validity`` weighs what speaks against each estimate, and
``published`` makes the table of both. ``rows`` builds large tables lazily. ``model_gap`` compares the estimates with
the aircraft file. ``covariance`` says which errors of the derivatives go together.
"""
