"""Layer ``aircraft``: what is known of an aircraft before it flies: geometry, mass, controls, derivatives, noise.

``document`` reads YAML with places for error messages, ``load`` turns an aircraft file into a ``model.Aircraft``, and
``dump`` does the reverse. ``names`` defines the names of coefficients, regressors and derivatives.
"""
