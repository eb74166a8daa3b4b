"""The documentation page of effects, written from the effects themselves.

``effects_page`` writes equation, parameters and source of each effect, and simulates doublets with and without it;
``line_chart`` draws both responses.
"""
