"""Manoeuvres: their text, their predicted information, and how they are flown.

``spec`` reads a text such as ``3211:elevator:amplitude=0.05:start=2`` (grammar: the reference page on manoeuvres) into
``segment``s, whose ``kinds`` give the ``shapes`` of the inputs (``multisine`` among them); sampled and checked against
the aircraft's limits they are a ``manoeuvre``. ``prediction`` computes the ``information`` of a manoeuvre before anyone
flies it, and ``optimise`` searches the ``search_space`` for the least predicted errors. ``exciter`` flies a manoeuvre
on top of somebody else's commands until the estimates are accurate enough.
"""
