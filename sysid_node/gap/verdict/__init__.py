"""Verdict: what the scores of selection and validation mean.

``measurement`` fills the table of scores, and ``decision`` decides from it on one of five words. ``localisation`` says
where in the simulator's chain and when the gap lies, and ``next_flight`` proposes the manoeuvre that would best
separate the effects that are still confused. ``diagnose`` puts all of it into its result.
"""
