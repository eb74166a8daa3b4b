"""What a fleet tells: populations of derivatives, drift of tails, and whether a gap is the simulator's or one tail's.

``summarise`` turns the flights' estimates into a ``FleetSummary``. ``series`` sorts estimates by type and derivative,
``random_effects`` fits their three-level model, ``drift`` tests each tail over time, ``causes`` pools the diagnoses of
the gap, and ``prior`` writes what is known of a tail as an aircraft file.
"""
