"""Flights made ready for a diagnosis: what was measured and commanded, on one regular time base.

A recorded flight is low-passed and resampled to the analysis rate (``gap_flight``). Flow angles and thrust that
nobody measured are inferred (``flow_angles``, ``thrust``), and a flight alone is cut to its manoeuvre
(``manoeuvre_window``). The result is a ``GapFlight``, from which ``residuals`` makes what is compared.
"""
