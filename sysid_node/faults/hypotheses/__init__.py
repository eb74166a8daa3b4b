"""Hypotheses of failure, and the evidence for each in an interval of flight.

``catalogue`` lists what may have failed as changes of the reference model's derivatives; ``weighing`` and
``bayes_factors`` compare them on the residuals. ``servo_check`` compares measured surface positions with commands,
``vane_check`` finds jammed vanes. ``monitor`` decides when to announce a fault.
"""
