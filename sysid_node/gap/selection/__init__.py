"""Selection: which effects explain the residual, and how probable each is.

Candidates are screened (``screening``), fitted (``candidate_fitter``, ``onset``) and compared with the explanation
without them (``comparison``). ``forward_selection`` adds those that ``acceptance`` accepts; ``alternatives`` replaces
causes as ``replacement`` decides; ``causes`` keeps those that ``retention`` keeps, by a calibrated probability
(``calibration``, ``misspecification``). ``validation`` then tests the explanation on flight that was not fitted.
"""
