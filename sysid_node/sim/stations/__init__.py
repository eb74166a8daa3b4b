"""The stations of the chain, one module each, in the order from command to message.

A station composes the effects that act at it. Its functions work on scalars and on whole time series alike; ``model``'s
chain and ``prediction`` call them.
"""
