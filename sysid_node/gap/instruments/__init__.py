"""Instrumental variables: what the commands say of a residual, free of the bias that gusts and feedback cause.

``excitation`` separates external inputs from feedback, and ``gust_free_signals`` makes instruments of them.
``moment_equations`` are what the instruments see of a fit; ``overidentification`` tests whether a residual is
correlated with them, ``liml`` estimates sizes without bias, and ``bayes_factor`` compares two explanations.
``selection`` uses these to decide which candidates to accept.
"""
