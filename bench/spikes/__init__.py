"""Spike and recovery: known effects put into real flight records, and what ``sysid gap`` says of them.

``records`` lists the flights and makes the aircraft file that is believed. ``editing`` puts an effect into a record, or
into the belief. ``drawing`` draws cases, ``judging`` says what of a diagnosis is right, ``ledger`` keeps it by line.
"""
