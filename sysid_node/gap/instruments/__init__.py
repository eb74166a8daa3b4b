"""Instrumental variables: what the commands say of a residual, free of the bias that gusts and feedback cause.

``excitation`` separates external input from feedback, ``overidentification`` tests whether a residual is correlated
with the instruments, and ``liml`` estimates sizes without that bias. ``bayes_factor`` compares two explanations by
the part of the residual that the commands explain. ``selection`` asks these tests which candidates to accept.
"""
