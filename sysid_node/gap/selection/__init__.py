"""Selection: which effects explain the residual, and how probable each is.

Candidates are screened and fitted (``candidate_fitter``), added one by one (``forward_selection``) where they predict
better and matter (``acceptance``), and held against their alternatives (``alternatives``). ``misspecification`` tests
whether an effect's equation fits, ``calibration`` turns the evidence into a probability, and ``causes`` keeps what is
probable. ``validation`` checks the result on flight that was not fitted.
"""
