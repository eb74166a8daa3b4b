"""Verdict: what the numbers of selection and validation mean.

``decision`` says it in one of five words, ``localisation`` says where in the simulator's chain and when the gap lies.
``next_flight`` proposes the manoeuvre that would best separate the remaining candidates. ``diagnose`` puts all three
into its result.
"""
