"""The documentation page of effects, written from the effects themselves.

``effects_page`` writes equation, parameters and source of each effect; ``line_chart`` draws what it does.
"""
