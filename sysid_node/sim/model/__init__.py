"""The simulator's equations as pure functions.

``parameters`` holds the parameters of all effects as one vector, ``layout`` says what shapes the compiled program,
and ``chain`` evaluates all stations at one instant. ``prediction`` evaluates the same stations on measured signals.
``flying`` integrates the chain.
"""
