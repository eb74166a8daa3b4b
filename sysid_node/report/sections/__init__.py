"""The sections of the pages, one module each: from a result to the variables of a template.

The modules here draw a run of an estimator; ``gap`` and ``manoeuvre`` hold the sections of those two pages.
"""
