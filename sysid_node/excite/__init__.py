"""Layer ``excite``: what to fly. Manoeuvres from a compact text, their information, and the best of them.

``parse_manoeuvre("3211:elevator:amplitude=0.05:start=2", aircraft)`` gives a ``Manoeuvre``: deflections from trim over
time, checked against the aircraft's limits. ``information`` predicts standard errors and correlations of the
derivatives before anyone flies; ``optimise`` shapes a manoeuvre for the least predicted error. Grammar:
docs/reference/manoeuvres.md.
"""
